"""What a run of `rhot track` did: counts per camera and stream, warnings and notes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import msgspec

from rhot.messages import MarkerFrame
from services.cli.offline.clocks.camera_clock import CameraClock, clock_text


class CameraSummary(msgspec.Struct, frozen=True, kw_only=True):
    """One camera: frames read, frames with a marker, and markers found, all and per colour."""

    frames: int
    frames_with_markers: int
    detections: int
    colors: dict[str, int]


class Origin(msgspec.Struct, frozen=True, kw_only=True):
    """What was tracked, for who needs its pictures again: as `rhot track` takes it, paths absolute.

    config is the rig.toml that was named, "" if none was.
    """

    sources: list[str]
    config: str = ""
    rates: list[str] = []


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """summary.json. No times of day and no durations: the same input writes the same bytes.

    refusals counts what fusion could not use, by reason; complete is false if a recording could not
    be read to its end, and warnings say which; notes say what was left out or looks wrong. clocks:
    of all cameras but the first, where one was not simply believed. origin is None where nobody
    tracked: in what a recording's messages are unpacked to.
    """

    rig: str
    cameras: dict[str, CameraSummary]
    markers: int
    points: int
    poses: int
    objects: int
    contacts: int = 0
    refusals: dict[str, int]
    complete: bool
    warnings: list[str]
    notes: list[str]
    clocks: list[CameraClock] | msgspec.UnsetType = msgspec.UNSET
    origin: Origin | None = None


class CameraCounter:
    """Counts the frames and markers of one camera."""

    def __init__(self) -> None:
        self._frames = self._with_markers = 0
        self._colors: Counter[str] = Counter()

    def add(self, frame: MarkerFrame) -> None:
        """Count one frame."""
        self._frames += 1
        self._with_markers += bool(frame.markers)
        self._colors.update(marker.color for marker in frame.markers)

    def summary(self) -> CameraSummary:
        """The counts so far."""
        return CameraSummary(
            frames=self._frames,
            frames_with_markers=self._with_markers,
            detections=self._colors.total(),
            colors=dict(sorted(self._colors.items())),
        )


def summary_text(summary: Summary, out: Path) -> str:
    """A few lines for people; out is the result's folder."""
    lines = []
    for name, camera in summary.cameras.items():
        colors = ", ".join(f"{color} {count}" for color, count in camera.colors.items())
        lines.append(
            f"{name}: {camera.frames} frames, markers in {camera.frames_with_markers} "
            f"({colors or 'none'})"
        )
    lines.append(
        f"{out}: {summary.points} sets of points, {summary.poses} hand poses, "
        f"{summary.objects} object poses"
        + (f", {summary.contacts} sets of contacts" if summary.contacts else "")
    )
    lines += [] if summary.clocks is msgspec.UNSET else map(clock_text, summary.clocks)
    return "\n".join(lines)
