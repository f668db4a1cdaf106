"""Hue of BT.601 chroma, and differences and means of hues, which are angles. Pure.

Hues are OpenCV's: 0..180 for a full turn, so that one step is two degrees.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

# Mostly float64; OpenCV's stubs do not say the type of what it returns.
Array = npt.NDArray[Any]
Hue = TypeVar("Hue", float, Array)

# BT.601 with Y in 16..235: R = L + 1.596 V', G = L - .392 U' - .813 V', B = L + 2.017 U',
# where L = 1.164 (Y - 16), U' = U - 128, V' = V - 128.
LUMA_GAIN = 255.0 / 219.0
_RED_V, _GREEN_U, _GREEN_V, _BLUE_U = 1.596027, -0.391762, -0.812968, 2.017232


class ChromaHue(NamedTuple):
    """What chroma alone says of a colour, whatever its luma; all of one shape."""

    hue: Array  # 0..180, 0 of grey
    spread: Array  # max - min of R, G, B
    top: Array  # max of R, G, B less L


def hue_of_chroma(u: Array, v: Array) -> ChromaHue:
    """Hue and spread of chroma u = U - 128, v = V - 128 of any shape.

    RGB is not rounded and not clipped to 0..255.
    """
    red = _RED_V * v
    green = _GREEN_U * u + _GREEN_V * v
    blue = _BLUE_U * u
    top = np.maximum(np.maximum(red, green), blue)
    spread = top - np.minimum(np.minimum(red, green), blue)
    divisor = np.maximum(spread, 1e-9)
    sector = np.where(
        top == red,
        (green - blue) / divisor,
        np.where(top == green, 2.0 + (blue - red) / divisor, 4.0 + (red - green) / divisor),
    )
    return ChromaHue(np.where(spread > 0.0, (30.0 * sector) % 180.0, 0.0), spread, top)


def hue_difference(hue: Hue, other: Hue | float) -> Hue:
    """Signed difference hue - other, -90..90; of one hue or of an array."""
    return (hue - other + 90.0) % 180.0 - 90.0


def mean_hue(hue: Array, weight: Array) -> float:
    """Circular mean of hues, 0..180; 0 of none."""
    angle = hue * (np.pi / 90.0)
    return float(
        np.arctan2(np.sum(weight * np.sin(angle)), np.sum(weight * np.cos(angle)))
        * (90.0 / np.pi)
        % 180.0
    )
