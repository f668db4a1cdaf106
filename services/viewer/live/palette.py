"""Colours of the live view: of joints by their source, of markers by their paint. Pure.

An unknown paint is grey.
"""

from __future__ import annotations

import colorsys
from collections.abc import Iterable
from typing import NamedTuple

from rhot.files.calibration import ColorRange, Colors
from rhot.messages import JointSource

Rgb = tuple[int, int, int]

# Measured, solved and predicted can be told apart at a glance, also with red-green blindness (after
# Okabe and Ito's palette).
SOURCE_RGB: dict[JointSource, Rgb] = {
    "measured": (0, 158, 115),
    "solved": (25, 90, 255),
    "predicted": (230, 159, 0),
}
UNKNOWN: Rgb = (150, 150, 150)
# A finger tip that touches is lit; no source and no paint has this colour.
TOUCH: Rgb = (255, 214, 10)
# An object that is touched: between its own green and that light.
TOUCHED: Rgb = (150, 205, 40)
# Where it touches: seen on the object as on the finger.
CONTACT: Rgb = (255, 50, 50)
TRACKER: Rgb = (45, 45, 50)
# A joint that can bend no further: no other thing of the scene is purple.
LIMIT: Rgb = (190, 50, 160)
# Thin lines, and what they fade into: the page's own background.
LINE: Rgb = (75, 75, 85)
BACKGROUND: Rgb = (250, 250, 250)
# A skin that is nobody's: light enough for joints to be seen beneath it.
SKIN: Rgb = (196, 146, 118)
# Paints by the names people use in rig.toml, calibrated or not.
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


class LegendEntry(NamedTuple):
    """A colour of the scene, and what it means to who looks."""

    rgb: Rgb
    words: str


LEGEND: tuple[LegendEntry, ...] = (
    LegendEntry(SOURCE_RGB["measured"], "measured: the cameras see it"),
    LegendEntry(SOURCE_RGB["solved"], "solved: worked out from what they see"),
    LegendEntry(SOURCE_RGB["predicted"], "predicted: expected there, not seen now"),
    LegendEntry(TOUCH, "touches"),
    LegendEntry(CONTACT, "where it touches"),
    LegendEntry(LIMIT, "can bend no further"),
)


def paint_rgb(color: str, calibrations: Iterable[Colors]) -> Rgb:
    """RGB of a paint: by its name, else by the middle hue of its calibrated range, else grey."""
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
