"""Selecting live pictures worth keeping, and telling the person with the board what to do. Pure.

Cameras without a common trigger take their pictures tens of milliseconds apart. So a position of
the board counts only once the board has stood still over two takes in every camera. A position like
one that is already kept teaches nothing. A camera that does not see the board is named.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import board_view
from services.calibrator.board.coverage import Coverage, coverage
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.initial_guess import guess_board_pose, ideal_lens

# RMS motion between two takes, px at 640 px width. A board in a steady hand moves .1-.3 px; one
# pixel of motion is one of error.
_STILL_PX = 0.5
# RMS distance of corners from every kept position, as a share of the width: a twentieth of it shows
# the board in another place or turn.
_NEW_SHARE = 0.05
# Focal length assumed for the tilt, in widths, before there is a calibration: a field of view of 60
# degrees.
_FOCAL = 0.87
# Tilt of at least one kept board, below which the person is told to tilt it, degrees.
_TILT_DEG = 20.0


class Verdict(Enum):
    """What became of a take, as the person reads it."""

    KEPT = "kept"
    UNSEEN = "the board is not seen as a whole"
    MOVING = "hold still"
    KNOWN = "move or tilt the board"


@dataclass(frozen=True)
class TakeResult:
    """The verdict on one take, and the cameras it is about: blind ones, or those it moves in."""

    verdict: Verdict
    cameras: tuple[str, ...] = ()


class LiveSelection:
    """Board positions that all cameras see, selected from takes until there are `wanted`."""

    def __init__(self, cameras: list[str], board: Board, wanted: int) -> None:
        self.cameras = cameras
        self.board = board
        self.wanted = wanted
        self.kept: list[dict[str, Detection]] = []
        self._previous: dict[str, Detection] = {}

    @property
    def done(self) -> bool:
        """Whether there are enough positions."""
        return len(self.kept) >= self.wanted

    def offer(self, take: dict[str, Detection | None]) -> TakeResult:
        """Keep a take, what each camera detected at about the same time, or say why not."""
        found = {
            camera: detection
            for camera in self.cameras
            if (detection := take.get(camera)) is not None
        }
        previous, self._previous = self._previous, found
        unseen = tuple(camera for camera in self.cameras if camera not in found)
        if unseen:
            return TakeResult(Verdict.UNSEEN, unseen)
        moving = tuple(
            camera for camera in found if not _stands_still(found[camera], previous.get(camera))
        )
        if moving:
            return TakeResult(Verdict.MOVING, moving)
        if any(self._is_like(found, kept) for kept in self.kept):
            return TakeResult(Verdict.KNOWN)
        self.kept.append(found)
        return TakeResult(Verdict.KEPT)

    def coverage(self, camera: str) -> Coverage:
        """What the kept positions cover of a camera's picture."""
        detections = [position[camera] for position in self.kept]
        size_px = detections[0].size_px if detections else (1, 1)
        lens = ideal_lens(size_px, _FOCAL * size_px[0])
        poses = [
            guess_board_pose(lens, board_view(self.board, detection, 0, 0))[0]
            for detection in detections
        ]
        return coverage(size_px, [detection.corners for detection in detections], poses)

    def text(self, result: TakeResult | None = None) -> str:
        """One line: how many positions there are, what is missing, what to do."""
        parts = [f"{len(self.kept)}/{self.wanted} positions"]
        if self.kept:
            parts += self._coverage_texts()
        if result is not None:
            cameras = f" ({', '.join(result.cameras)})" if result.cameras else ""
            parts.append(result.verdict.value + cameras)
        return "; ".join(parts)

    def _coverage_texts(self) -> list[str]:
        by_camera = {camera: self.coverage(camera) for camera in self.cameras}
        shares = [f"{camera} {100 * each.share:.0f} %" for camera, each in by_camera.items()]
        texts = ["covered " + ", ".join(shares)]
        missing = [f"{camera} {each.missing}" for camera, each in by_camera.items() if each.missing]
        if missing:
            texts.append(f"missing: {missing[0]}")
        if all(max(each.tilt_deg) < _TILT_DEG for each in by_camera.values()):
            texts.append("tilt the board")
        return texts

    def _is_like(self, found: dict[str, Detection], kept: dict[str, Detection]) -> bool:
        return all(
            _distance_px(found[camera], kept[camera]) < _NEW_SHARE * found[camera].size_px[0]
            for camera in self.cameras
        )


def _stands_still(now: Detection, previous: Detection | None) -> bool:
    if previous is None:
        return False
    return _distance_px(now, previous) <= _STILL_PX * now.size_px[0] / 640.0


def _distance_px(a: Detection, b: Detection) -> float:
    """RMS distance in px of the corners in both detections; inf if they share none."""
    _, first, second = np.intersect1d(a.ids, b.ids, return_indices=True)
    if not len(first):
        return float("inf")
    offset: Array = a.corners[first] - b.corners[second]
    return float(np.sqrt(np.mean(np.sum(offset * offset, axis=1))))
