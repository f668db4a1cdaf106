"""Dots of one colour in a recording, told apart with hindsight. Pure.

Live, the likeliest account of the moment is told, which later pictures may contradict. Of a
recording each picture is told as that account has it which is the likeliest in the end; and the
whole is searched in several ways (search.py), of which the one counts whose account makes all
pictures together the likeliest (evidence.py). Names that were exchanged for a while, by a search
that gave up the right account too soon, are then right from where they were lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from services.pi_tracker.dots.dot import Dot, Patch
from services.pi_tracker.dots.evidence import evidence
from services.pi_tracker.dots.hypothesis import SHARED
from services.pi_tracker.dots.search import SEVERAL, Search
from services.pi_tracker.dots.tracker import MERGED_QUALITY, DotTracker, arrays_of, seen_alone

# How often each picture is searched.
LOOKS = len(SEVERAL)


class SeenPatches(NamedTuple):
    """The patches of a picture, in the order in which they were found."""

    time_s: float
    patches: list[Patch]


Begin = Callable[[Search], DotTracker]


def look_back(
    begin: Begin, pictures: Sequence[SeenPatches], advance: Callable[[], None] = lambda: None
) -> list[dict[str, Dot]]:
    """The dots of all pictures by landmark, empty ones before tracking has started.

    begin makes a tracker that remembers, of the given search; advance is called LOOKS times for
    each picture. Takes five times as long as following the dots once.
    """
    best: list[dict[str, Dot]] = [{} for _ in pictures]
    accounts: list[list[tuple[int, ...]]] = []
    most = -np.inf
    for search in SEVERAL:
        tracker = begin(search)
        for picture in pictures:
            tracker.step(picture.patches, picture.time_s)
            advance()
        told = [one.patch for one in tracker.way()]
        if tracker.begun is None or told in accounts:
            continue
        accounts.append(told)
        seen = pictures[len(pictures) - len(told) :]
        arrays = [arrays_of(one.patches) for one in seen]
        nats = evidence(tracker.begun, arrays, [one.time_s for one in seen], told)
        if nats > most:
            most, best = nats, _dots(tracker.names, told, [one.patches for one in pictures])
    return best


def _dots(
    names: tuple[str, ...], told: list[tuple[int, ...]], patches: list[list[Patch]]
) -> list[dict[str, Dot]]:
    """Dots of the pictures from the first that an account knows."""
    before = len(patches) - len(told)
    areas: dict[str, list[float]] = {name: [] for name in names}
    for own, found in zip(told, patches[before:], strict=True):
        for name, index in zip(names, own, strict=True):
            if index >= 0 and own.count(index) == 1:
                areas[name].append(found[index].area_px)
    usual = {name: float(np.median(own)) if own else 0.0 for name, own in areas.items()}
    dots: list[dict[str, Dot]] = [{} for _ in range(before)]
    for own, found in zip(told, patches[before:], strict=True):
        dots.append(
            {
                name: _dot(own, index, found, usual[name])
                for name, index in zip(names, own, strict=True)
                if index >= 0
            }
        )
    return dots


def _dot(told: tuple[int, ...], index: int, patches: list[Patch], area_px: float) -> Dot:
    """One dot that was seen; area_px is its usual one, 0 if it never was alone."""
    patch = patches[index]
    if told.count(index) > 1:
        diameter = float(np.sqrt(4.0 / np.pi * (area_px or patch.area_px)))
        sigma = float(np.hypot(patch.sigma_px, SHARED * diameter))
        quality = MERGED_QUALITY * patch.quality
        return Dot(patch.x_px, patch.y_px, sigma, quality, "merged", patch.area_px, index)
    return seen_alone(told, index, patches, area_px, 1.0)
