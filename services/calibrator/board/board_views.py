"""Detected boards as the views of an adjustment, and the pictures that are left out of it. Pure."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.residuals import View


@dataclass(frozen=True)
class LeftOut:
    """A picture that was not used, and why."""

    camera: str
    key: str
    reason: str


def same_size(
    camera: str, detections: dict[str, Detection]
) -> tuple[tuple[int, int], dict[str, Detection], list[LeftOut]]:
    """The size that most pictures have, the detections in those pictures, and the other pictures.

    Without any picture the size is (0, 0).
    """
    if not detections:
        return (0, 0), {}, []
    sizes = Counter(detection.size_px for detection in detections.values())
    size_px = sizes.most_common(1)[0][0]
    kept, left_out = {}, []
    for key, detection in detections.items():
        if detection.size_px == size_px:
            kept[key] = detection
        else:
            reason = f"is {_size_text(detection.size_px)}, the others {_size_text(size_px)}"
            left_out.append(LeftOut(camera, key, reason))
    return size_px, kept, left_out


def board_view(board: Board, detection: Detection, camera: int, number: int) -> View:
    """One detection as the view of board position `number` by camera number `camera`."""
    return View(camera, number, detection.ids, board.points[detection.ids], detection.corners)


def _size_text(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]}x{size_px[1]}"
