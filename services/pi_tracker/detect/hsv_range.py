"""HSV ranges, as people edit them, in terms of chroma and luma.

At a fixed chroma (u, v) the colours of all lumas differ by grey only. So hue and the spread max -
min of R, G, B are fixed, and the bounds on saturation = spread / value and on value become one
interval of luma. Pure.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from rhot.files.calibration import ColorRange
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.hue import LUMA_GAIN, ChromaHue, hue_difference, hue_of_chroma

Array = npt.NDArray[np.float64]


def hue_of_all_chroma() -> ChromaHue:
    """Hue and spread of every chroma, at index u + 256 v; (65536,) each."""
    v, u = np.divmod(np.arange(65536), 256)
    return hue_of_chroma(u - 128.0, v - 128.0)


def luma_interval(color_range: ColorRange, chroma: ChromaHue) -> tuple[Array, Array]:
    """Lowest and highest luma (n,) at which a chroma lies in the range; low > high: at none.

    OpenCV rounds hue, saturation and value, hence the halves. Bounds of 0 and 255 do not bound, as
    RGB saturates there.
    """
    hue, spread, top = chroma
    h0, s0, v0 = color_range.hsv_low
    h1, s1, v1 = color_range.hsv_high
    value_low = np.full_like(hue, v0 - 0.5) if v0 > 0 else np.full_like(hue, -np.inf)
    value_high = np.full_like(hue, v1 + 0.5) if v1 < 255 else np.full_like(hue, np.inf)
    if s0 > 0:
        value_high = np.minimum(value_high, 255.0 * spread / (s0 - 0.5))
    if s1 < 255:
        value_low = np.maximum(value_low, 255.0 * spread / (s1 + 0.5))
    low = np.ceil(np.maximum((value_low - top) / LUMA_GAIN + 16.0, 0.0))
    high = np.floor(np.minimum((value_high - top) / LUMA_GAIN + 16.0, 255.0))
    # A range that is empty (low above high) stays empty: clipping must not turn it into one of a
    # single luma.
    low, high = np.minimum(low, 256.0), np.maximum(high, -1.0)
    inside = _hue_inside(hue, h0, h1)
    return np.where(inside, low, 256.0), np.where(inside, high, -1.0)


def _hue_inside(hue: Array, low: int, high: int) -> npt.NDArray[np.bool_]:
    if low <= high:
        # A hue just below 180 rounds to 180, which OpenCV writes as 0.
        return ((hue >= low - 0.5) & (hue < high + 0.5)) | ((low == 0) & (hue >= 179.5))
    return (hue >= low - 0.5) | (hue < high + 0.5)


def hue_width(color_range: ColorRange) -> int:
    """Width of a range's hues, which may wrap through 180."""
    return (color_range.hsv_high[0] - color_range.hsv_low[0]) % 180


def hue_centre(color_range: ColorRange) -> float:
    """Middle of a range's hues; above 180 if they wrap."""
    return color_range.hsv_low[0] + hue_width(color_range) / 2.0


def hue_distance(color_range: ColorRange, hue: Array) -> Array:
    """Distance of hues (n,) from the middle of the range, in half widths of it; (n,)."""
    difference = hue_difference(hue, hue_centre(color_range))
    return np.abs(difference) / (hue_width(color_range) / 2.0 + 0.5)


def hsv_mask(hsv: Image, color_range: ColorRange) -> Image:
    """The RHOT paper's test on an HSV image (h, w, 3): 255 inside the range.

    Low hue above high wraps through red.
    """
    low, high = np.array(color_range.hsv_low, np.uint8), np.array(color_range.hsv_high, np.uint8)
    if color_range.hsv_low[0] <= color_range.hsv_high[0]:
        return cv2.inRange(hsv, low, high)
    above = cv2.inRange(hsv, low, np.array([179, *color_range.hsv_high[1:]], np.uint8))
    below = cv2.inRange(hsv, np.array([0, *color_range.hsv_low[1:]], np.uint8), high)
    return cv2.bitwise_or(above, below)
