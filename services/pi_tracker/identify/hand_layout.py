"""How far apart markers of a hand are in a picture, by which landmarks they mark. Pure.

In widths of the markers themselves, which say how near the hand is: neighbouring fingers are a few
apart, a tip and the wrist's dab many. Six things in a room have some other layout, as a rule.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from rhot.hand import BASIC_LANDMARKS, TIPS
from services.pi_tracker.image.blob import Blob

# Colour -> hand and landmark.
Landmarks = Mapping[str, tuple[str, str]]
NO_LANDMARKS: Landmarks = MappingProxyType({})

# Least and most, in roots of the geometric mean of two areas: a little more than 98 % of pairs are
# within, of hands from a child's to a large adult's that show any of seven gestures in 240 pictures
# of simulated rooms. A tip and one so many fingers on:
_FINGERS_APART = {1: 9.0, 2: 12.0, 3: 14.0}
# The thumb's tip and the index finger's, the next one's, ...
_THUMB_APART = (12.0, 14.0, 15.0, 16.0)
# The wrist's dab and the tips, from the thumb's on.
_WRIST_LEAST, _WRIST_APART = 4.0, (17.0, 20.0, 20.0, 20.0, 18.0)
_WRIST = BASIC_LANDMARKS[0]
# Beyond these a pair counts less with this power of its squared distance.
_POWER = 4


class HandLayout:
    """Of `colors`, by their index, which pairs are as far apart as two landmarks of a hand."""

    def __init__(self, colors: Sequence[str], landmarks: Landmarks) -> None:
        known = [landmarks.get(color) for color in colors]
        self._spans = [[_span(a, b) for b in known] for a in known]

    def nearness(self, a: Blob, b: Blob) -> float | None:
        """How well two blobs' distance is that of the landmarks they would be, 0..1.

        None where nothing is known of that: they are not of one hand, or mark other joints.
        """
        span = self._spans[a.color][b.color]
        if span is None:
            return None
        least, most = span
        distance2 = (a.x_px - b.x_px) ** 2 + (a.y_px - b.y_px) ** 2
        widths2 = max(distance2, 1.0) / (a.area_px * b.area_px) ** 0.5
        too_far, too_near = (widths2 / most**2) ** _POWER, (least**2 / widths2) ** _POWER
        return 1.0 / ((1.0 + too_far) * (1.0 + too_near))


def _span(a: tuple[str, str] | None, b: tuple[str, str] | None) -> tuple[float, float] | None:
    """Least and most that two landmarks of a hand are apart, None if nothing is known."""
    if a is None or b is None or a[0] != b[0]:
        return None
    names = {a[1], b[1]}
    tips = sorted(TIPS.index(name) for name in names & set(TIPS))
    if len(names) == 2 and _WRIST in names and tips:
        return _WRIST_LEAST, _WRIST_APART[tips[0]]
    if len(tips) != 2:
        return None
    first, second = tips
    if first == 0:
        return 0.0, _THUMB_APART[second - 1]
    return 0.0, _FINGERS_APART[second - first]
