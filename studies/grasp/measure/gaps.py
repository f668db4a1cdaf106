"""Joints that were not seen for a moment, put where they were on their way. Pure.

A dot that one picture blurs or another finger hides for a moment costs no measurement: it is where
the pictures before and after say, less surely, and the picture's note says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from studies.grasp.measure.joints import Place, Seen

# So many pictures at most: a finger that closes in 2 s turns by 10 degrees in three of 30 a second.
LONGEST = 3
# What is said of the quality of a place that was not seen.
_QUALITY = 0.3
_NOTE = "{why} (its place is from the pictures around)"


def bridged(pictures: Sequence[Seen], longest: int = LONGEST) -> list[Seen]:
    """The same pictures, with places in gaps of at most so many."""
    places = [dict(seen.places) for seen in pictures]
    lost = [dict(seen.lost) for seen in pictures]
    for name in {name for seen in pictures for name in seen.lost}:
        known = [number for number, seen in enumerate(pictures) if name in seen.places]
        for before, after in pairwise(known):
            if not 1 < after - before <= longest + 1:
                continue
            for number in range(before + 1, after):
                places[number][name] = _between(pictures, name, known, (before, number, after))
                why = pictures[number].lost.get(name, "not seen")
                lost[number][name] = _NOTE.format(why=why)
    return [
        seen._replace(places=places[number], lost=lost[number])
        for number, seen in enumerate(pictures)
    ]


def _between(
    pictures: Sequence[Seen], name: str, known: list[int], at: tuple[int, int, int]
) -> Place:
    """A place on the cubic through the two pictures before and the two after, where there are.

    Its sigma is that of the places beside it, and half of what the cubic differs from the straight
    line: an acceleration that nobody saw.
    """
    before, number, after = at
    first = known.index(before)
    around = known[max(first - 1, 0) : first + 3]
    times = np.array([pictures[k].time_s for k in around])
    points = np.array([pictures[k].places[name][:2] for k in around])  # (2..4, 2)
    # Lagrange's weights of each picture at the instant.
    time_s = pictures[number].time_s
    weights = [
        np.prod([(time_s - other) / (own - other) for other in times if other != own])
        for own in times
    ]
    x, y = np.array(weights) @ points
    a, b = pictures[before], pictures[after]
    share = (time_s - a.time_s) / max(b.time_s - a.time_s, 1e-9)
    start, end = a.places[name], b.places[name]
    line = (1.0 - share) * np.array(start[:2]) + share * np.array(end[:2])
    bend = float(np.hypot(x - line[0], y - line[1]))
    sigma = float(np.hypot(max(start.sigma_px, end.sigma_px), 0.5 * bend))
    return Place(float(x), float(y), sigma, _QUALITY * min(start.quality, end.quality))
