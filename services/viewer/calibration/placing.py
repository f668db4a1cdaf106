"""A camera's picture on a canvas of the shape of the scene's window, above the panel on a phone.

Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from services.viewer.calibration.picture import Image

# In a window as narrow as a phone's the panel covers the lower part, and so much is above it; in
# others it is docked beside the scene.
_NARROW_PX, _ABOVE = 640, 0.45
_MARGIN = 0.03
# A larger canvas is only sent for longer; a window that has said nothing yet is a small one.
_MOST_PX, _LEAST_PX = 1600, 240
_BACKGROUND = 238


class Place(NamedTuple):
    """Where the picture is in the window: left, top, width and height, 0 to 1."""

    left: float
    top: float
    width: float
    height: float

    def in_picture(self, x: float, y: float) -> tuple[float, float]:
        """A point of the window (0 to 1) in the picture, 0 to 1 if it is inside."""
        return (x - self.left) / self.width, (y - self.top) / self.height


def placed(rgb: Image, window_px: tuple[int, int]) -> tuple[Image, Place]:
    """The picture (h, w, 3) on a canvas of the window's shape, and where it is there."""
    width, height = (max(int(one), _LEAST_PX) for one in window_px)
    free_h = int(_ABOVE * height) if width < _NARROW_PX else height
    scale = (1.0 - 2.0 * _MARGIN) * min(width / rgb.shape[1], free_h / rgb.shape[0])
    shrink = min(1.0, _MOST_PX / max(width, height))
    canvas_w, canvas_h = round(width * shrink), round(height * shrink)
    w, h = (max(1, round(side * scale * shrink)) for side in (rgb.shape[1], rgb.shape[0]))
    left, top = round(0.5 * (width * shrink - w)), round(0.5 * (free_h * shrink - h))
    canvas = np.full((canvas_h, canvas_w, 3), _BACKGROUND, np.uint8)
    shown = cv2.resize(rgb, (w, h), interpolation=cv2.INTER_LINEAR)
    canvas[top : top + h, left : left + w] = shown
    return canvas, Place(left / canvas_w, top / canvas_h, w / canvas_w, h / canvas_h)
