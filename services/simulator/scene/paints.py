"""Surfaces of the simulated world: acrylic paints, skin, objects. Pure data.

A colour is an albedo, the share of white light that a surface reflects: linear RGB, 0..1. A colour
name that no paint has is a ConfigError with the valid names.
"""

from __future__ import annotations

import difflib
from typing import NamedTuple

from rhot.errors import ConfigError

Rgb = tuple[float, float, float]


class Surface(NamedTuple):
    """How a surface looks: diffuse albedo (linear RGB), gloss 0..1, shininess (Blinn-Phong
    exponent), strength of its texture.
    """

    albedo: Rgb
    gloss: float
    shininess: float
    texture: float


# Lightly tanned skin: sRGB (201, 152, 126) under white light, within the range of the Pantone
# SkinTone guide.
SKIN = Surface((0.56, 0.31, 0.21), 0.05, 12.0, 0.11)

# RHOT section 9.1: colours outside the hues of skin (green, blue) are unproblematic, "red tones in
# the purple and magenta section" work; lime to magenta are the rig's default, spread over the hue
# circle (OpenCV hue 42, 68, 92, 112, 134, 162) and all bright enough that noise of 5 grey levels
# does not blur their hue. The others are for larger sets, and for seeing why skin hues fail. Leaf
# (hue 53) is the seventh, for a tracker: of the simulated rooms and hands 1e-6 of the pixels are in
# its range, in that of yellow 8 %, orange 7 %, red 5 %.
PAINTS: dict[str, Rgb] = {
    "lime": (0.44, 0.72, 0.04),
    "leaf": (0.093, 0.69, 0.02),
    "green": (0.03, 0.44, 0.13),
    "cyan": (0.02, 0.42, 0.50),
    "blue": (0.03, 0.13, 0.64),
    "violet": (0.26, 0.09, 0.62),
    "magenta": (0.66, 0.03, 0.34),
    "yellow": (0.80, 0.62, 0.03),
    "orange": (0.80, 0.25, 0.02),
    "red": (0.62, 0.03, 0.03),
    "pink": (0.85, 0.30, 0.48),
    "white": (0.85, 0.85, 0.83),
}
# Dried acrylic is somewhat glossy: a window shows as a small highlight.
_PAINT_GLOSS, _PAINT_SHININESS, _PAINT_TEXTURE = 0.22, 40.0, 0.04


def paint(name: str) -> Surface:
    """The paint of that colour name.

    Raises ConfigError listing the valid names.
    """
    if name not in PAINTS:
        near = difflib.get_close_matches(name, PAINTS, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise ConfigError(f"the simulator has no paint {name!r}; {hint}Valid: {', '.join(PAINTS)}")
    return Surface(PAINTS[name], _PAINT_GLOSS, _PAINT_SHININESS, _PAINT_TEXTURE)


# A matt grey-brown ceramic, and the black plastic of a Vive tracker.
CUP = Surface((0.30, 0.26, 0.22), 0.15, 30.0, 0.05)
TRACKER = Surface((0.025, 0.025, 0.028), 0.10, 20.0, 0.04)
