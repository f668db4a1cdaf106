"""Pictures that show the board where another one has it: they add nothing. Pure.

Copies of one picture, or frames of a board that nobody moved, calibrate like one picture, and worse
than that: what is held out has its twin in the calibration, so held-out errors flatter.
"""

from __future__ import annotations

import numpy as np

from rhot.errors import CalibrationError
from services.calibrator.board.board_views import LeftOut
from services.calibrator.board.detect import Detection

# Corners that moved less than this, px at 640 px width, are the same picture with other noise: .1
# to .3 px. A board in a hand moves by more from one picture to the next.
_COPY_PX = 0.5
# Views less apart than this are one place of the board for the question whether it was moved.
_PLACE_PX = 6.0


def without_copies(
    camera: str, detections: dict[str, Detection]
) -> tuple[dict[str, Detection], list[LeftOut]]:
    """The pictures but for copies of earlier ones, and the copies."""
    kept: dict[str, Detection] = {}
    copies = []
    for key, seen in detections.items():
        first = next((k for k, one in kept.items() if _apart_px(one, seen) < _COPY_PX), None)
        if first is None:
            kept[key] = seen
        else:
            copies.append(LeftOut(camera, key, f"shows the board exactly where {first} does"))
    return kept, copies


def check_places(camera: str, detections: dict[str, Detection], needed: int) -> None:
    """Raise CalibrationError if as many pictures as needed show fewer places of the board."""
    places: list[Detection] = []
    for seen in detections.values():
        if all(_apart_px(one, seen) >= _PLACE_PX for one in places):
            places.append(seen)
    if len(detections) < needed or len(places) >= needed:
        return
    alike = "all" if len(places) == 1 else "nearly all"
    raise CalibrationError(
        f"camera {camera!r}: {alike} {len(detections)} pictures show the board at the same place "
        f"({len(places)} different of at least {needed} that are needed, 12 to 20 are good): are "
        "they copies of one picture, or frames of a video in which nobody moved the board? Take "
        "pictures of the board at other places and turned another way each time"
    )


def _apart_px(one: Detection, other: Detection) -> float:
    """How far the corner that moved most has moved, px at 640 px width; infinite if not the same
    corners are seen.
    """
    if one.size_px != other.size_px or not np.array_equal(one.ids, other.ids):
        return float("inf")
    moved = np.linalg.norm(one.corners - other.corners, axis=1)
    return float(moved.max()) * 640.0 / one.size_px[0]
