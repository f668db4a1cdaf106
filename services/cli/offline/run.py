"""One run of `rhot track`: recordings through the pipeline, frame by frame, into a result folder.

An error leaves no result, an interruption .partial files (results.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rhot.errors import CalibrationError, CaptureError
from rhot.files.calibration import load_colors, load_lens, load_objects
from rhot.files.capture import read_lines
from rhot.files.config import RigConfig
from rhot.messages import MarkerFrame
from rhot.messages.objects import ObjectPose, OpenVrPose
from services.cli.offline.contacts import ContactTrack
from services.cli.offline.inputs import Job
from services.cli.offline.pipeline import Output, Pipeline, geometry, merged
from services.cli.offline.results import ResultWriter
from services.cli.offline.track_summary import CameraCounter, Summary
from services.cli.progress import Progress
from services.object_tracker.step import ObjectStep
from services.pi_tracker.step import TrackerStep


def run(job: Job, out: Path, progress: bool | None = False) -> Summary:
    """Track one job into the folder `out`. progress None shows it on a terminal only.

    Raises RhotError if anything needed is missing, or if no frame could be read.
    """
    cameras, markers_only = geometry(job.config, job.cameras)
    trackers = {one.camera: tracker_step(job.config, one.camera) for one in job.inputs}
    clock_sigma_ns = {one.camera: one.clock_sigma_ns for one in job.inputs}
    pipeline = Pipeline(job.config, trackers, clock_sigma_ns, cameras)
    with ResultWriter(out) as writer:
        # First, as it takes no time and a broken line should not come up after an hour of video.
        object_notes = _track_objects(job, writer)
        contacts = ContactTrack(job.config, writer.written("objects", ObjectPose))
        counters = _track_frames(job, pipeline, contacts, writer, progress)
        warnings = [warning for one in job.inputs for warning in one.warnings]
        notes = [markers_only] if markers_only else []
        notes += [note for one in job.inputs for note in one.notes]
        summary = Summary(
            rig=job.config.rig.name,
            cameras={name: counter.summary() for name, counter in counters.items()},
            **writer.counts,
            refusals=pipeline.refusals,
            complete=not warnings,
            warnings=warnings,
            notes=[*notes, *object_notes, *_pose_notes(pipeline, writer.counts)],
        )
        writer.finish(summary)
    return summary


def _track_frames(
    job: Job,
    pipeline: Pipeline,
    contacts: ContactTrack,
    writer: ResultWriter,
    progress: bool | None,
) -> dict[str, CameraCounter]:
    """All frames through the pipeline into the result; the counts by camera."""
    counters = {name: CameraCounter() for name in job.cameras}
    shown = Progress("rhot track:", sum(one.total for one in job.inputs), progress)
    try:
        for output in _outputs(job, pipeline):
            for markers in output.markers:
                counters[markers.camera].add(markers)
            _write(writer, output, contacts)
            shown.advance()
        _write(writer, pipeline.flush(), contacts)
    finally:
        shown.end()
    return counters


def _outputs(job: Job, pipeline: Pipeline) -> Iterator[Output]:
    """What each frame leads to: of pictures, or of markers that somebody found already."""
    if job.markers is None:
        yield from map(pipeline.step, merged([one.frames() for one in job.inputs]))
        return
    for number, frame in enumerate(read_lines(job.markers, MarkerFrame), start=1):
        if frame.camera not in job.cameras:
            raise CaptureError(
                f"{job.markers}: line {number}: camera {frame.camera!r} is not in rig.toml; it has"
                f" {', '.join(job.cameras)}"
            )
        yield pipeline.fuse(frame)


def tracker_step(config: RigConfig, name: str) -> TrackerStep:
    """The tracker of one camera with its calibration.

    Raises CalibrationError naming the command that helps.
    """
    colors = load_colors(config.calibration_dir, name)
    path = config.calibration_dir / f"{name}.colors.json"
    # Without a hand in rig.toml no landmark chooses the colours: all are tracked.
    wanted = config.tracked_colors(colors.colors)
    if not wanted:
        raise CalibrationError(
            f"{path}: has no colour; add one with `rhot calibrate colors {name}`"
        )
    lens = load_lens(config.calibration_dir, name) if config.tracker.rectify else None
    size_px = config.camera_named(name).size_px
    return TrackerStep(name, colors, config.tracker, size_px, wanted, colors_path=path, lens=lens)


def _write(writer: ResultWriter, output: Output, contacts: ContactTrack) -> None:
    writer.write("markers", output.markers)
    writer.write("points", output.points)
    writer.write("poses", output.poses)
    writer.write("contacts", contacts.step(output.poses))


def _track_objects(job: Job, writer: ResultWriter) -> list[str]:
    """objects.jsonl through the object tracker; notes on what is missing."""
    if job.objects is None or not job.config.object:
        return []
    folder = job.config.calibration_dir
    registration = load_objects(folder) if (folder / "objects.json").exists() else None
    step = ObjectStep(job.config, registration)
    for line in read_lines(job.objects, OpenVrPose):
        pose = step.step(line)
        if pose is not None:
            writer.write("objects", [pose])
    notes = []
    if registration is None:
        notes.append(
            "objects stay in the lighthouse frame: calibration/objects.json is missing; "
            "make it with `rhot calibrate objects`"
        )
    if step.unknown:
        serials = ", ".join(sorted(step.unknown_serials))
        notes.append(
            f"{step.unknown} poses of devices that no [[object]] of rig.toml names: {serials}"
        )
    prefix = "left_out_"
    left_out = [
        f"{n:.0f} {name.removeprefix(prefix).replace('_', ' ')}"
        for name, n in sorted(step.values().items())
        if name.startswith(prefix)
    ]
    if left_out:
        notes.append(f"poses of objects left out: {', '.join(left_out)}")
    stale = step.faults(0)["registration_stale"].values()
    return notes + [f"the registration does not hold: {text}" for text in stale]


def _pose_notes(pipeline: Pipeline, counts: dict[str, int]) -> list[str]:
    """A note where markers gave no pose although a hand was asked for."""
    if pipeline.hands and counts["markers"] and not counts["poses"]:
        return ["no hand pose came out: `rhot plot` shows which markers are missing"]
    return []
