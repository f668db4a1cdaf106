"""Where a picture lies in a window of another shape, and where a click is in it. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Image = npt.NDArray[Any]
# What is beside the picture: as light as the page.
_BESIDE = 245


@dataclass(frozen=True)
class Fitted:
    """A picture in its window: rgb (h, w, 3) has the window's shape; box is left, top, right and
    bottom of the picture in it, as shares of the window.
    """

    rgb: Image
    box: tuple[float, float, float, float]

    def inside(self, x: float, y: float) -> tuple[float, float] | None:
        """A place in the window (0 to 1) as a place in the picture (0 to 1), None beside it."""
        left, top, right, bottom = self.box
        if not (left <= x <= right and top <= y <= bottom):
            return None
        return (x - left) / (right - left), (y - top) / (bottom - top)


def fitted(rgb: Image, aspect: float) -> Fitted:
    """A picture (h, w, 3) as large as fits into a window of that width / height.

    It is not scaled: the window's pixels are the picture's. In an upright window, as a phone's, it
    lies at the top: controls come up from below.
    """
    height, width = rgb.shape[:2]
    if width / height > aspect:
        full_width, full_height = width, max(height, round(width / aspect))
    else:
        full_width, full_height = max(width, round(height * aspect)), height
    left = (full_width - width) // 2
    top = 0 if aspect < 1.0 else (full_height - height) // 2
    whole = np.full((full_height, full_width, 3), _BESIDE, np.uint8)
    whole[top : top + height, left : left + width] = rgb
    box = (
        left / full_width,
        top / full_height,
        (left + width) / full_width,
        (top + height) / full_height,
    )
    return Fitted(whole, box)
