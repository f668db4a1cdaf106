"""Which live pictures are worth keeping, and what the person with the board should do next. Pure.

Cameras without a common trigger take their pictures tens of milliseconds apart, so a position
counts only once the board has stood still over two takes in every camera; a position like one that
is already there teaches nothing. A camera that does not see the board is named.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.coverage import Coverage, coverage
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.initial_guess import board_pose, centred
from services.calibrator.bundle.residuals import View

# RMS motion between two takes, px at 640 px width. A board in a steady hand moves .1-.3 px; one
# pixel of motion is one of error.
_STILL_PX = 0.5
# RMS distance of corners from every kept position, as a share of the width: a tenth of it shows the
# board in another place or turn.
_NEW_SHARE = 0.05
# Focal length assumed for the tilt, in widths, before there is a calibration: a field of view of 60
# degrees.
_FOCAL = 0.87
# Tilts wanted before saying so no longer, degrees.
_TILT_DEG = 20.0


class Verdict(Enum):
    """What became of a take."""

    KEPT = "kept"
    UNSEEN = "the board is not seen as a whole"
    MOVING = "hold still"
    KNOWN = "move or tilt the board"


@dataclass(frozen=True)
class Take:
    """The verdict on one take of all cameras, and the cameras it is about (that do not see the
    board, that saw it move).
    """

    verdict: Verdict
    cameras: tuple[str, ...] = ()


class Collector:
    """Collects board positions that all cameras see, until there are `wanted`."""

    def __init__(self, cameras: list[str], board: Board, wanted: int) -> None:
        self.cameras = cameras
        self.board = board
        self.wanted = wanted
        self.kept: list[dict[str, Detection]] = []
        self._before: dict[str, Detection] = {}

    @property
    def done(self) -> bool:
        """Whether there are enough positions."""
        return len(self.kept) >= self.wanted

    def offer(self, seen: dict[str, Detection | None]) -> Take:
        """One take: what each camera saw at about the same time."""
        found = {
            camera: detection
            for camera in self.cameras
            if (detection := seen.get(camera)) is not None
        }
        before, self._before = self._before, found
        blind = tuple(camera for camera in self.cameras if camera not in found)
        if blind:
            return Take(Verdict.UNSEEN, blind)
        moving = tuple(
            camera
            for camera, now in found.items()
            if camera not in before
            or not _apart(now, before[camera]) <= _STILL_PX * now.size_px[0] / 640.0
        )
        if moving:
            return Take(Verdict.MOVING, moving)
        if any(self._like(found, old) for old in self.kept):
            return Take(Verdict.KNOWN)
        self.kept.append(found)
        return Take(Verdict.KEPT)

    def coverage(self, camera: str) -> Coverage:
        """What the kept positions cover of a camera's picture."""
        views = [position[camera] for position in self.kept]
        size_px = views[0].size_px if views else (1, 1)
        lens = centred(size_px, _FOCAL * size_px[0])
        poses = [
            board_pose(lens, View(0, 0, view.ids, self.board.points[view.ids], view.corners))[0]
            for view in views
        ]
        return coverage(size_px, [view.corners for view in views], poses)

    def text(self, take: Take | None = None) -> str:
        """One line: how far it is, what is missing, what to do."""
        parts = [f"{len(self.kept)}/{self.wanted} positions"]
        if self.kept:
            seen = {camera: self.coverage(camera) for camera in self.cameras}
            parts.append(
                "covered "
                + ", ".join(f"{camera} {100 * each.share:.0f} %" for camera, each in seen.items())
            )
            missing = next(
                (f"{camera} {each.missing}" for camera, each in seen.items() if each.missing), ""
            )
            if missing:
                parts.append(f"missing: {missing}")
            if all(max(each.tilt_deg) < _TILT_DEG for each in seen.values()):
                parts.append("tilt the board")
        if take is not None:
            who = f" ({', '.join(take.cameras)})" if take.cameras else ""
            parts.append(take.verdict.value + who)
        return "; ".join(parts)

    def _like(self, found: dict[str, Detection], old: dict[str, Detection]) -> bool:
        return all(
            _apart(found[camera], old[camera]) < _NEW_SHARE * found[camera].size_px[0]
            for camera in self.cameras
        )


def _apart(a: Detection, b: Detection) -> float:
    """RMS distance in px of the corners both saw; inf if they share none."""
    _, first, second = np.intersect1d(a.ids, b.ids, return_indices=True)
    if not len(first):
        return float("inf")
    offset: Array = a.corners[first] - b.corners[second]
    return float(np.sqrt(np.mean(np.sum(offset * offset, axis=1))))
