"""One run of `rhot track`: recordings through the pipeline, frame by frame, into a result folder.

The markers of all frames come first, as the cameras' clocks are found from the whole recording
(clocks/); then what follows from them, by clocks put right. Nobody waits for points, so each may
wait for frames after it; and hands that nobody measured are followed twice, the second time at the
size that the first one found. An error leaves no result, an interruption .partial files
(results.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from pathlib import Path

import msgspec

from rhot.errors import CalibrationError, CaptureError
from rhot.files.calibration import load_colors, load_objects, load_rig_cameras
from rhot.files.capture import read_lines
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.messages import MarkerFrame
from rhot.messages.objects import ObjectPose, OpenVrPose
from services.cli.offline.clocks.alignment import Clocks
from services.cli.offline.clocks.by_hand import offsets_of
from services.cli.offline.clocks.recorded_markers import RecordedMarkers
from services.cli.offline.contacts import ContactTrack
from services.cli.offline.frames.camera_input import CameraInput
from services.cli.offline.frames.duplicate_frames import DuplicateFrames
from services.cli.offline.frames.known_room import with_known_room
from services.cli.offline.inputs import Job
from services.cli.offline.looking_back import looked_back
from services.cli.offline.pipeline import Output, Pipeline, find_markers, geometry, merged
from services.cli.offline.results import ResultWriter
from services.cli.offline.seeds import dot_notes, seeds_of
from services.cli.offline.track_summary import CameraCounter, Summary
from services.cli.progress import Progress
from services.object_tracker.step import ObjectStep
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.pi_tracker.step import TrackerStep

# Frames that a point waits for: as many as fusion can use.
_HINDSIGHT_FRAMES = 2
# A hand whose size is farther from what rig.toml says is noted: points tell it to 2 or 3 %.
_OTHER_SIZE = 0.04


def run(
    job: Job,
    out: Path,
    progress: bool | None = False,
    offsets: Sequence[str] = (),
    seeds: Sequence[str] = (),
    *,
    as_live: bool = False,
) -> Summary:
    """Track one job into the folder `out`. progress None shows it on a terminal only.

    offsets: CAM=SECONDS by hand; seeds: [CAM:]LANDMARK=X,Y of dots; as_live: no hindsight, but
    what a running rig tells at the time. Raises RhotError if anything needed is missing, or if no
    frame could be read.
    """
    by_hand = offsets_of(offsets, job.cameras)
    cameras, markers_only = geometry(job.config, job.cameras)
    starts = seeds_of(seeds, job.config, job.cameras)
    trackers = {
        one.camera: tracker_step(job.config, one.camera, job.colors, starts[one.camera])
        for one in job.inputs
    }
    config = job.config if as_live else _with_hindsight(job.config)
    pipeline = Pipeline(config, cameras, align_clocks=not by_hand)
    with ResultWriter(out) as writer, closing(RecordedMarkers(out)) as recorded:
        # First, as it takes no time and a broken line should not come up after an hour of video.
        object_notes = _track_objects(job, writer)
        contacts = ContactTrack(job.config, writer.written("objects", ObjectPose))
        duplicates = {one.camera: DuplicateFrames() for one in job.inputs}
        streams = [
            _stream(one, duplicates[one.camera], None if as_live else trackers[one.camera])
            for one in job.inputs
        ]
        counters = _find_markers(job, trackers, cameras, streams, recorded, progress)
        clocks = _find_clocks(job, recorded, cameras, by_hand)
        if pipeline.sizes and not as_live:
            pipeline = _with_all_learned(pipeline, clocks, progress)
        for output in _outputs(pipeline, clocks, "points and poses of", progress):
            _write(writer, output, contacts)
        unread = [warning for one in job.inputs for warning in one.warnings]
        notes = [markers_only] if markers_only else pipeline.tilts
        notes += [note for one in job.inputs for note in one.notes]
        notes += [text for one in job.inputs if (text := duplicates[one.camera].text(one.camera))]
        summary = Summary(
            rig=job.config.rig.name,
            cameras={name: counter.summary() for name, counter in counters.items()},
            **writer.counts,
            refusals=pipeline.refusals,
            complete=not unread,
            warnings=[*unread, *clocks.warnings, *dot_notes(trackers)],
            notes=[*notes, *object_notes, *_pose_notes(job, pipeline, writer.counts)],
            clocks=clocks.told if clocks.worth_telling else msgspec.UNSET,
            origin=job.origin,
        )
        writer.finish(summary, clocks.told)
    return summary


def _find_markers(
    job: Job,
    trackers: Mapping[str, TrackerStep],
    cameras: dict[str, Camera] | None,
    streams: Sequence[Iterable[Frame]],
    recorded: RecordedMarkers,
    progress: bool | None,
) -> dict[str, CameraCounter]:
    """The markers of all frames; the counts by camera."""
    counters = {name: CameraCounter() for name in job.cameras}
    found = _marker_frames(job, trackers, cameras or {}, streams, progress)
    if job.markers is None and job.config.dots:
        found = looked_back(found, trackers, len(job.config.dots), recorded.folder, progress)
    for markers in found:
        counters[markers.camera].add(markers)
        recorded.add(markers)
    return counters


def _stream(
    one: CameraInput, duplicates: DuplicateFrames, tracker: TrackerStep | None
) -> Iterable[Frame]:
    """A camera's pictures, none of them twice; a tracker, if given, sees the beginning first."""
    frames = duplicates.new_frames(one.frames())
    return frames if tracker is None else with_known_room(frames, tracker)


def _marker_frames(
    job: Job,
    trackers: Mapping[str, TrackerStep],
    cameras: Mapping[str, Camera],
    streams: Sequence[Iterable[Frame]],
    progress: bool | None,
) -> Iterator[MarkerFrame]:
    """The markers of each frame: of pictures, or those that somebody found already."""
    shown = Progress("rhot track:", sum(one.total for one in job.inputs), progress)
    clock_sigma_ns = {one.camera: one.clock_sigma_ns for one in job.inputs}
    found: Iterable[MarkerFrame]
    if job.markers is None:
        found = (
            find_markers(
                frame,
                trackers[frame.camera],
                clock_sigma_ns[frame.camera],
                cameras.get(frame.camera),
            )
            for frame in merged(streams)
        )
    else:
        found = _recorded_markers(job.markers, job.cameras)
    try:
        for markers in found:
            yield markers
            shown.advance()
    finally:
        shown.end()


def _recorded_markers(path: Path, cameras: Sequence[str]) -> Iterator[MarkerFrame]:
    """Those that somebody found already. Raises CaptureError."""
    for number, frame in enumerate(read_lines(path, MarkerFrame), start=1):
        if frame.camera not in cameras:
            raise CaptureError(
                f"{path}: line {number}: camera {frame.camera!r} is not in rig.toml; it has"
                f" {', '.join(cameras)}"
            )
        yield frame


def _find_clocks(
    job: Job,
    recorded: RecordedMarkers,
    cameras: dict[str, Camera] | None,
    by_hand: dict[str, float],
) -> Clocks:
    """The cameras' clocks, by their markers or by hand."""
    clocks = Clocks(recorded, job.cameras)
    unknown = any(recorded.unknown(name) for name in job.cameras)
    if len(job.cameras) > 1 and (cameras is not None or unknown or by_hand):
        if cameras is None:
            # Without a hand nothing asked for them yet.
            with suppress(CalibrationError):
                cameras = load_rig_cameras(job.config, job.cameras)
        clocks.find(cameras, job.cameras, by_hand, tune=job.config.fusion.tune_clocks)
    return clocks


def _with_hindsight(config: RigConfig) -> RigConfig:
    fusion = msgspec.structs.replace(config.fusion, lag_frames=_HINDSIGHT_FRAMES)
    return msgspec.structs.replace(config, fusion=fusion)


def _with_all_learned(pipeline: Pipeline, clocks: Clocks, progress: bool | None) -> Pipeline:
    """The pipeline with what the whole recording tells of hands' sizes and cameras' tilts."""
    for _ in _outputs(pipeline, clocks, "sizes of hands in", progress):
        pass
    return pipeline.again()


def _outputs(
    pipeline: Pipeline, clocks: Clocks, what: str, progress: bool | None
) -> Iterator[Output]:
    """What follows from all markers."""
    shown = Progress(f"rhot track: {what}", clocks.total, progress)
    try:
        for output in pipeline.outputs(clocks.frames()):
            yield output
            shown.advance(len(output.markers))
    finally:
        shown.end()


def _write(writer: ResultWriter, output: Output, contacts: ContactTrack) -> None:
    writer.write("markers", output.markers)
    writer.write("points", output.points)
    writer.write("poses", output.poses)
    writer.write("contacts", contacts.step(output.poses))


def tracker_step(
    config: RigConfig,
    name: str,
    only: Sequence[str] = (),
    seeds: Mapping[str, tuple[float, float]] | None = None,
) -> TrackerStep:
    """The tracker of one camera with its calibration, for `only` these colours if any are named.

    Raises CalibrationError naming the command that helps.
    """
    colors = load_colors(config.calibration_dir, name)
    path = config.calibration_dir / f"{name}.colors.json"
    # Without a hand in rig.toml no landmark chooses the colours: all are tracked.
    wanted = list(only) or config.tracked_colors(colors.colors)
    if not wanted:
        raise CalibrationError(
            f"{path}: has no colour; add one with `rhot calibrate colors {name}`"
        )
    return step_of_rig(
        config, name, colors, wanted, colors_path=path, seeds=seeds, remembers_dots=True
    )


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


def _pose_notes(job: Job, pipeline: Pipeline, counts: dict[str, int]) -> list[str]:
    """Notes where markers gave no pose although a hand was asked for, or a hand of another size."""
    if pipeline.hands and counts["markers"] and not counts["poses"]:
        return ["no hand pose came out: `rhot plot` shows which markers are missing"]
    return [
        f"the {hand} hand was never measured, and is by its points {size:.2f} times an adult's; "
        f"`scale = {size:.2f}` in [hand.{hand}] of rig.toml tells it to a live rig"
        for hand, size in pipeline.sizes.items()
        if abs(size / job.config.hand[hand].scale - 1.0) > _OTHER_SIZE
    ]
