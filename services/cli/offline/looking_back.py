"""Dots of one colour of a whole recording: found frame by frame, then named with hindsight."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from pathlib import Path

import msgspec

from rhot.messages import MarkerFrame
from services.cli.offline.clocks.recorded_markers import RecordedMarkers
from services.cli.progress import Progress
from services.pi_tracker.dots.hindsight.looking_back import LOOKS
from services.pi_tracker.step import TrackerStep


def looked_back(
    frames: Iterable[MarkerFrame],
    trackers: Mapping[str, TrackerStep],
    colors: int,
    folder: Path,
    progress: bool | None,
) -> Iterator[MarkerFrame]:
    """Frames as they are found, each again once all are, with the dots of hindsight.

    colors: how many are shared by several landmarks. folder has room for an unnamed file. Raises
    DiskFullError.
    """
    with closing(RecordedMarkers(folder)) as first:
        for frame in frames:
            first.add(frame)
        shown = Progress("rhot track: dots with hindsight", LOOKS * colors * len(first), progress)
        try:
            again = {name: iter(one.looked_back(shown.advance)) for name, one in trackers.items()}
        finally:
            shown.end()
        for frame in first.frames():
            names = trackers[frame.camera].dot_names
            others = [marker for marker in frame.markers if marker.color not in names]
            # None at all of a camera whose shared colour was not asked for.
            dots = next(again[frame.camera], [])
            yield msgspec.structs.replace(frame, markers=others + dots)
