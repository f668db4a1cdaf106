"""Blobs as a detector would find them, without a picture: squares, and six markers of a hand.

For tests of data association. Pure.
"""

from __future__ import annotations

import numpy as np

from services.pi_tracker.image.blob import Blob, make_blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.planes import Rect

# Places of five tips in an arc and a wrist, px from the middle of the hand.
_HAND_PX = ((-60, -20), (-30, -60), (0, -70), (30, -60), (55, -40), (0, 60))


def filled_blob(color: int, rect: Rect, mask: Image | None = None) -> Blob:
    """A blob of a rectangle of cells, full but for a mask (h, w)."""
    x0, y0, x1, y1 = rect
    mask = np.ones((y1 - y0, x1 - x0), np.uint8) if mask is None else mask
    return make_blob(color, rect, mask, int(np.count_nonzero(mask)))


def square_blob(color: int, x_px: float, y_px: float, side_px: int = 14) -> Blob:
    """A square blob about a pixel."""
    cells = max(side_px // 2, 1)
    x0, y0 = round(x_px / 2 - cells / 2), round(y_px / 2 - cells / 2)
    return filled_blob(color, (x0, y0, x0 + cells, y0 + cells))


def hand_blobs(x_px: float, y_px: float, side_px: int = 14) -> list[Blob]:
    """One blob per colour: five tips in an arc and a wrist."""
    return [
        square_blob(color, x_px + dx, y_px + dy, side_px) for color, (dx, dy) in enumerate(_HAND_PX)
    ]
