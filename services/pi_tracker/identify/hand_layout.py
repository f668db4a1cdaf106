"""How far apart markers of a hand are in a picture, by which landmarks they mark. Pure.

In widths of the markers themselves, which say how near the hand is: neighbouring fingers are a few
apart, a tip and the wrist's dab many. Six things in a room have some other layout, as a rule.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS, TIPS

Ints = npt.NDArray[np.int64]
# Colour -> hand and landmark.
Landmarks = Mapping[str, tuple[str, str]]
NO_LANDMARKS: Landmarks = MappingProxyType({})

_WRIST, _UNKNOWN = BASIC_LANDMARKS[0], (math.nan, math.nan)
# Least and most, in roots of the geometric mean of two areas: a little more than 98 % of pairs are
# within, of hands from a child's to a large adult's that show any of seven gestures in 240 pictures
# of simulated rooms. A tip and one so many fingers on:
_FINGERS_APART = {1: 9.0, 2: 12.0, 3: 14.0}
# The thumb's tip and the index finger's, the next one's, ...
_THUMB_APART = (12.0, 14.0, 15.0, 16.0)
# The wrist's dab and the tips, from the thumb's on.
_WRIST_LEAST, _WRIST_APART = 4.0, (17.0, 20.0, 20.0, 20.0, 18.0)
# Beyond these a pair counts less with this power of its squared distance.
_POWER = 4


class HandLayout:
    """Of `colors`, by their index, which pairs are as far apart as two landmarks of a hand."""

    def __init__(self, colors: Sequence[str], landmarks: Landmarks) -> None:
        known = [landmarks.get(color) for color in colors]
        spans = np.array([[_span(a, b) for b in known] for a in known]).reshape(
            len(colors), len(colors), 2
        )
        self._least, self._most = spans[:, :, 0], spans[:, :, 1]

    def nearness(self, colors: Ints, distance2: Array, areas_px2: Array) -> Array:
        """How well distances of n blobs are those of the landmarks they would be, 0..1; (n, n).

        colors (n,) by their index; distance2 (n, n), px^2; areas_px2 (n, n), a mean of both. NaN
        where nothing is known: they are not of one hand, are of one colour, or mark other joints.
        """
        pairs = np.ix_(colors, colors)
        least2, most2 = self._least[pairs] ** 2, self._most[pairs] ** 2
        widths2 = np.maximum(distance2, 1.0) / areas_px2
        too_far, too_near = (widths2 / most2) ** _POWER, (least2 / widths2) ** _POWER
        return 1.0 / ((1.0 + too_far) * (1.0 + too_near))


def _span(a: tuple[str, str] | None, b: tuple[str, str] | None) -> tuple[float, float]:
    """Least and most that two landmarks of a hand are apart, NaN if nothing is known."""
    if a is None or b is None or a[0] != b[0]:
        return _UNKNOWN
    names = {a[1], b[1]}
    tips = sorted(TIPS.index(name) for name in names & set(TIPS))
    if len(names) == 2 and _WRIST in names and tips:
        return _WRIST_LEAST, _WRIST_APART[tips[0]]
    if len(tips) != 2:
        return _UNKNOWN
    first, second = tips
    if first == 0:
        return 0.0, _THUMB_APART[second - 1]
    return 0.0, _FINGERS_APART[second - first]
