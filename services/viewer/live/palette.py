"""Colours of the live view: sources of joints, paints of markers. Pure.

A colour nobody knows is grey.
"""

from __future__ import annotations

import colorsys
from collections.abc import Iterable

from rhot.files.calibration import ColorRange, Colors
from rhot.messages import JointSource

Rgb = tuple[int, int, int]

# Tell seen from guessed at a glance, also with red-green blindness (after Okabe and Ito's palette).
SOURCE_RGB: dict[JointSource, Rgb] = {
    "measured": (0, 158, 115),
    "solved": (60, 120, 225),
    "predicted": (230, 159, 0),
}
UNKNOWN: Rgb = (150, 150, 150)
# Paints people name in rig.toml before they have calibrated them.
_NAMED: dict[str, Rgb] = {
    "red": (220, 40, 40),
    "orange": (240, 130, 20),
    "yellow": (240, 210, 30),
    "lime": (150, 220, 40),
    "green": (30, 160, 60),
    "cyan": (20, 190, 210),
    "blue": (30, 90, 220),
    "violet": (130, 60, 200),
    "purple": (130, 60, 200),
    "magenta": (220, 40, 160),
    "pink": (240, 130, 180),
    "white": (245, 245, 245),
    "black": (30, 30, 30),
}


def paint_rgb(color: str, calibrations: Iterable[Colors]) -> Rgb:
    """A paint as it should look: by its name, else by the middle hue of its calibrated range, else
    grey.
    """
    if color in _NAMED:
        return _NAMED[color]
    for calibration in calibrations:
        if color in calibration.colors:
            return _range_rgb(calibration.colors[color])
    return UNKNOWN


def _range_rgb(bounds: ColorRange) -> Rgb:
    low, high = bounds.hsv_low[0], bounds.hsv_high[0]
    # OpenCV's hue has 180 steps; a low one above the high one wraps through red.
    hue = ((low + high + (180 if low > high else 0)) / 2.0) % 180.0 / 180.0
    # Ranges are wide in saturation and value; their middle would look dirty on any screen.
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.8, 0.9)
    return (round(255 * red), round(255 * green), round(255 * blue))
