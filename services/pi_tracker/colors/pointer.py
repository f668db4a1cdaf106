"""A pointer: the place of a paint in a picture, as a click or a box. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.errors import CalibrationError
from services.pi_tracker.image.chroma import Cells
from services.pi_tracker.image.planes import Rect

# A patch smaller than three cells (12 px) is not searched by the tracker either, by default; its
# colours would be the rim's.
MIN_CELLS = 3
# Half side of the window that a click's region grows in, as share of the picture's width: markers
# are far smaller, a calibration ball may be 1/6 wide.
_CLICK_WINDOW = 1.0 / 8.0


@dataclass(frozen=True)
class Pointer:
    """What a person points at in picture `frame`; full-image pixels.

    A click at (x, y), or, with a size, a box (x, y, width, height).
    """

    color: str
    frame: int
    x_px: float
    y_px: float
    width_px: float = 0.0
    height_px: float = 0.0

    @property
    def is_box(self) -> bool:
        return self.width_px > 0.0 or self.height_px > 0.0

    def __str__(self) -> str:
        place = f"{self.color}={self.x_px:g},{self.y_px:g}"
        if self.is_box:
            return f"box {place},{self.width_px:g},{self.height_px:g}"
        return f"click {place}"


def search_window(cells: Cells, pointer: Pointer) -> Rect:
    """The cells of a picture (h, w) in which the pointer's patch is searched.

    Raises CalibrationError for places outside the picture.
    """
    height, width = cells.shape
    # Boxes may reach beyond the picture, as things at its edge do; their middle may not.
    x, y = pointer.x_px + pointer.width_px / 2.0, pointer.y_px + pointer.height_px / 2.0
    if not (0.0 <= x < 2 * width and 0.0 <= y < 2 * height):
        raise CalibrationError(
            f"{pointer}: lies outside the picture, which is {2 * width}x{2 * height} px"
        )
    if pointer.is_box:
        x0, y0 = max(int(pointer.x_px) // 2, 0), max(int(pointer.y_px) // 2, 0)
        x1 = min(int(np.ceil((pointer.x_px + pointer.width_px) / 2.0)), width)
        y1 = min(int(np.ceil((pointer.y_px + pointer.height_px) / 2.0)), height)
        if (x1 - x0) * (y1 - y0) < MIN_CELLS or min(pointer.width_px, pointer.height_px) < 2.0:
            raise CalibrationError(f"{pointer}: is too small; draw it around the whole marker")
        return x0, y0, x1, y1
    reach = int(max(16.0, _CLICK_WINDOW * width))
    column, row = int(pointer.x_px) // 2, int(pointer.y_px) // 2
    return (
        max(column - reach, 0),
        max(row - reach, 0),
        min(column + reach + 1, width),
        min(row + reach + 1, height),
    )
