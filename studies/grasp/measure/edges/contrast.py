"""Edges along the normals of an outline, in colour, to a fraction of a pixel. Pure.

Of an edge it is asked how strong it is and what colour is inside of it: another finger's outline,
or the palm's, has another skin in another light inside. Colours are logarithms: a ratio of light
counts the same in light and in shade.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.frame import Image
from studies.grasp.measure.edges.segments import Array

# Below 16 levels a ratio is noise.
_DARK = 16.0
_LOGS = (255.0 / np.log1p(255.0 / _DARK) * np.log1p(np.arange(256) / _DARK)).astype(np.float32)
# Light, and twice the ratios of blue and of red to green: where a finger curves away from the lamp,
# light has edges that are no outline, and colour has none. DIP errors on subjects 1, 3, 5: 4.2 deg
# RMS by light alone, 3.0 with twice the colour, 3.1 with four times.
_COLOUR = 2.0
_LIGHT_AND_COLOUR = np.array(
    [[1 / 3, 1 / 3, 1 / 3], [_COLOUR, -_COLOUR, 0.0], [0.0, -_COLOUR, _COLOUR]], np.float32
)
_BLUR_PX, _STEP_PX = 1.0, 0.5
# Of each normal so many edges are kept; weaker ones than _FAINT levels a pixel are noise (RMS of
# rendered pictures: 0.5), those of _CLEAR count fully.
MOST, _FAINT, _CLEAR = 3, 2.0, 15.0
# The colour of the inside is taken so far from an edge, and may be this much off, levels RMS: a
# finger's own changes by 2 to 5 from picture to picture, its neighbours differ by 20 and more.
_INSIDE_PX, _COLOUR_SIGMA = 3.0, 15.0

Picture = npt.NDArray[np.float32]


class Found(NamedTuple):
    """Edges along n normals: how far outwards (n, MOST) px, weights (n, MOST) 0..1, 0 of none."""

    offsets: Array
    weights: Array


class Profiles(NamedTuple):
    """Colours (n, t, 3) along normals at distances (t,) px, outwards."""

    distances: Array
    colours: Picture


def colours_of(image: Image) -> Picture:
    """Light and colour of a picture (h, w, 3) BGR, as (h, w, 3), in levels, a little smoothed."""
    colours = cv2.transform(cv2.LUT(image, _LOGS), _LIGHT_AND_COLOUR)
    return np.asarray(cv2.GaussianBlur(colours, (0, 0), _BLUR_PX), dtype=np.float32)


def profiles(colours: Picture, points: Array, normals: Array, reach_px: float) -> Profiles:
    """What is seen along normals (n, 2) through points (n, 2)."""
    steps = round(reach_px / _STEP_PX) + 1
    distances = _STEP_PX * np.arange(-steps, steps + 1, dtype=np.float64)
    x = (points[:, :1] + normals[:, :1] * distances).astype(np.float32)
    y = (points[:, 1:] + normals[:, 1:] * distances).astype(np.float32)
    seen = cv2.remap(colours, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return Profiles(distances, np.asarray(seen, dtype=np.float32))


def edges_along(seen: Profiles, expected: Picture | None) -> Found:
    """The strongest edges of each profile; expected (n, 3): the colour inside of it."""
    slope = (seen.colours[:, 2:] - seen.colours[:, :-2]) / (2.0 * _STEP_PX)
    size = np.sqrt(np.square(slope).mean(axis=2))  # (n, t - 2)
    middle = size[:, 1:-1]
    peak = (middle >= size[:, :-2]) & (middle > size[:, 2:]) & (middle > _FAINT)
    height = np.where(peak, middle, 0.0)
    at = np.argsort(-height, axis=1)[:, :MOST]  # the strongest first
    rows = np.arange(len(size))[:, None]
    strength = height[rows, at].astype(np.float64)
    before, here, after = (size[rows, at + step].astype(np.float64) for step in (0, 1, 2))
    # The vertex of the parabola through the peak and its neighbours.
    curve = np.minimum(before - 2.0 * here + after, -1e-6)
    part = np.clip(0.5 * (before - after) / curve, -1.0, 1.0)
    offsets = seen.distances[at + 2] + _STEP_PX * part
    weights = np.minimum(strength / _CLEAR, 1.0)
    if expected is not None:
        off = _inside(seen, offsets) - expected[:, None]
        weights = weights * np.exp(-0.5 * np.square(off).mean(axis=2) / _COLOUR_SIGMA**2)
    return Found(offsets, weights)


def inside_colours(seen: Profiles) -> Picture:
    """The colour (n, 3) inside of the outline itself."""
    return _inside(seen, np.zeros((len(seen.colours), 1)))[:, 0]


def _inside(seen: Profiles, offsets: Array) -> Picture:
    """The colours (n, c, 3) inside of edges (n, c)."""
    at = np.round((offsets - _INSIDE_PX - seen.distances[0]) / _STEP_PX).astype(int)
    at = np.clip(at, 0, len(seen.distances) - 1)
    return seen.colours[np.arange(len(seen.colours))[:, None], at]


def tukey(miss: Array, limit: float) -> Array:
    """Weights of residuals: 1 at 0, 0 from the limit."""
    return np.square(np.maximum(1.0 - np.square(miss / limit), 0.0))
