"""Detected boards as the views of an adjustment, and the pictures that are left out of it. Pure."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.residuals import View

# Pictures of another size than the others that are no slip: at least so many, and such a share.
_SLIPS, _SLIP_SHARE = 2, 0.15


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


def size_doubt(camera: str, detections: dict[str, Detection]) -> str:
    """A sentence if the pictures come in two sizes, and neither is a slip of one; or empty."""
    sizes = Counter(detection.size_px for detection in detections.values())
    usual = sizes.most_common()
    if len(usual) < 2 or usual[1][1] < max(_SLIPS, _SLIP_SHARE * len(detections)):
        return ""
    (first, first_count), (second, second_count) = usual[:2]
    both = f"{first_count} are {_size_text(first)}, {second_count} are {_size_text(second)}"
    if first == second[::-1]:
        return (
            f"camera {camera!r}: the pictures are of two sizes ({both}): was the camera turned? A "
            "lens is calibrated with the camera held one way; the others would be left out"
        )
    return (
        f"camera {camera!r}: the pictures are of two sizes ({both}): are they of two cameras, or "
        "of two settings of one? A lens holds for one size; the others would be left out"
    )


def board_view(board: Board, detection: Detection, camera: int, number: int) -> View:
    """One detection as the view of board position `number` by camera number `camera`."""
    return View(camera, number, detection.ids, board.points[detection.ids], detection.corners)


def _size_text(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]}x{size_px[1]}"
