"""One run of `rhot track`: reads the recordings frame by frame, lets the pipeline work, writes the
result folder.

An error leaves no result, an interruption .partial files (results.py).
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from rhot.errors import CalibrationError
from rhot.files.calibration import load_colors, load_lens, load_objects
from rhot.files.capture import read_lines
from rhot.files.config import RigConfig
from rhot.messages import MarkerFrame, OpenVrPose
from services.cli.offline.inputs import Job
from services.cli.offline.pipeline import Output, Pipeline, geometry, merged
from services.cli.offline.results import CameraSummary, ResultWriter, Summary
from services.cli.progress import Progress
from services.object_tracker.step import ObjectStep
from services.pi_tracker.step import TrackerStep


def run(job: Job, out: Path, progress: bool | None = False) -> Summary:
    """Track one job into the folder `out`. progress None shows it on a terminal only.

    Raises RhotError if anything needed is missing, or if no frame could be read.
    """
    names = [one.camera for one in job.inputs]
    cameras, note = geometry(job.config, names)
    trackers = {name: _tracker(job.config, name) for name in names}
    pipeline = Pipeline(
        job.config, trackers, {one.camera: one.clock_sigma_ns for one in job.inputs}, cameras
    )
    tallies = {name: _Tally() for name in names}
    shown = Progress("rhot track:", sum(one.total for one in job.inputs), progress)
    with ResultWriter(out) as writer:
        # First, as it takes no time and a broken line should not come up after an hour of video.
        objects = _objects(job, writer)
        try:
            for frame in merged([one.frames() for one in job.inputs]):
                output = pipeline.step(frame)
                for markers in output.markers:
                    tallies[markers.camera].add(markers)
                _write(writer, output)
                shown.advance()
            _write(writer, pipeline.flush())
        finally:
            shown.end()
        broken = [warning for one in job.inputs for warning in one.warnings]
        notes = [
            *([note] if note else []),
            *(told for one in job.inputs for told in one.notes),
            *objects,
        ]
        summary = Summary(
            rig=job.config.rig.name,
            cameras={name: tally.summary() for name, tally in tallies.items()},
            **writer.counts,
            refusals=pipeline.refusals,
            complete=not broken,
            warnings=broken,
            notes=[*notes, *_doubts(pipeline, writer.counts)],
        )
        writer.finish(summary)
    return summary


def summary_text(summary: Summary, out: Path) -> str:
    """A few lines for people."""
    lines = []
    for name, camera in summary.cameras.items():
        colors = ", ".join(f"{color} {count}" for color, count in camera.colors.items())
        lines.append(
            f"{name}: {camera.frames} frames, markers in {camera.frames_with_markers} ({colors or 'none'})"
        )
    lines.append(
        f"{out}: {summary.points} sets of points, {summary.poses} hand poses, {summary.objects} object poses"
    )
    return "\n".join(lines)


class _Tally:
    """Counts of one camera."""

    def __init__(self) -> None:
        self._frames = self._with_markers = 0
        self._colors: Counter[str] = Counter()

    def add(self, frame: MarkerFrame) -> None:
        self._frames += 1
        self._with_markers += bool(frame.markers)
        self._colors.update(marker.color for marker in frame.markers)

    def summary(self) -> CameraSummary:
        return CameraSummary(
            frames=self._frames,
            frames_with_markers=self._with_markers,
            detections=self._colors.total(),
            colors=dict(sorted(self._colors.items())),
        )


def _tracker(config: RigConfig, name: str) -> TrackerStep:
    colors = load_colors(config.calibration_dir, name)
    path = config.calibration_dir / f"{name}.colors.json"
    # Without a hand nobody says which colours matter: all of them do.
    wanted = config.colors or sorted(colors.colors)
    if not wanted:
        raise CalibrationError(
            f"{path}: has no colour; add one with `rhot calibrate colors {name}`"
        )
    lens = load_lens(config.calibration_dir, name) if config.tracker.rectify else None
    return TrackerStep(
        name,
        colors,
        config.tracker,
        config.camera_named(name).size_px,
        wanted,
        colors_path=path,
        lens=lens,
    )


def _write(writer: ResultWriter, output: Output) -> None:
    writer.write("markers", output.markers)
    writer.write("points", output.points)
    writer.write("poses", output.poses)


def _objects(job: Job, writer: ResultWriter) -> list[str]:
    """objects.jsonl through the object tracker; what is worth telling."""
    if job.objects is None or not job.config.object:
        return []
    folder = job.config.calibration_dir
    places = load_objects(folder) if (folder / "objects.json").exists() else None
    step = ObjectStep(job.config, places)
    for line in read_lines(job.objects, OpenVrPose):
        pose = step.step(line)
        if pose is not None:
            writer.write("objects", [pose])
    notes = []
    if places is None:
        notes.append(
            "objects stay in the lighthouse frame: calibration/objects.json is missing; make it with `rhot calibrate objects`"
        )
    if step.unknown:
        serials = ", ".join(sorted(step.unknown_serials))
        notes.append(
            f"{step.unknown} poses of devices that no [[object]] of rig.toml names: {serials}"
        )
    return notes


def _doubts(pipeline: Pipeline, counts: dict[str, int]) -> list[str]:
    """What looks wrong although nothing failed."""
    if pipeline.hands and counts["markers"] and not counts["poses"]:
        return ["no hand pose came out: `rhot plot` shows which markers are missing"]
    return []
