"""Colours of cells, and whether two looks of them are of the same thing, within noise. Pure."""

from __future__ import annotations

import cv2
import numpy as np

from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture

# How far apart luma, U and V may be: so many standard deviations, and so many grey levels beside.
Gate = tuple[float, float]
# Noise counts up to so many grey levels. In a dim room five deviations of all of it reach from the
# wall to the paint before it; what a narrower gate takes for a difference are single cells. (Eight
# simulated clips with noise of 12 and 16 levels a pixel, which is 5.5 and 7 a cell, where ordinary
# pictures have 2.3: a camera found 26 to 100 % of visible tips without a bound, 78 to 100 % with 4,
# 98 to 100 % with 2.5.)
_MOST_NOISE = 2.5
_NOTHING = 0.0, 0.0, 0.0


def slices(rect: Rect) -> tuple[slice, slice]:
    """Rows and columns of a rectangle."""
    x0, y0, x1, y1 = rect
    return slice(y0, y1), slice(x0, x1)


def yuv(image: Picture, rect: Rect) -> Image:
    """Y, U, V of the cells of a rectangle, float32 (h, w, 3)."""
    luma, chroma = image.cells(rect)
    return np.dstack((luma, chroma)).astype(np.float32)


def agree(seen: Image, known: Image, noise: Noise, gate: Gate) -> Image:
    """Which of cells (h, w, 3), Y, U, V, float32, are within a gate about what is known of them."""
    # OpenCV's: twice as fast as numpy's on a blob's few hundred cells.
    return cv2.inRange(cv2.absdiff(seen, known), _NOTHING, _within(noise, gate)).view(np.bool_)


def agree_with(cells: Image, color: Image, noise: Noise, gate: Gate) -> Image:
    """Which of cells (h, w, 3), float32, are within a gate about one Y, U, V (3,)."""
    within = np.array(_within(noise, gate))
    return cv2.inRange(cells, color - within, color + within).view(np.bool_)


def _within(noise: Noise, gate: Gate) -> tuple[float, float, float]:
    sigmas, levels = gate
    luma, chroma = (
        sigmas * min(sigma, _MOST_NOISE) + levels for sigma in (noise.luma, noise.chroma)
    )
    return luma, chroma, chroma
