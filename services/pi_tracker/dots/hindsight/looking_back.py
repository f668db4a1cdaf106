"""Dots of one colour in a recording, told apart with hindsight. Pure.

Live, the likeliest account of the moment is told, which later pictures may contradict. A recording
is searched from its start in several ways (search.py), and from pictures in the middle of it
forwards and backwards (again.py). Of what these accounts say, the way through all pictures is told
that makes them the likeliest (weaving.py, evidence.py). Names that were exchanged for a while, by a
search that gave up the right account too soon, are then right from where they were lost. What all
searches have lost is searched on from the posture that this way has until there (resumed.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from services.pi_tracker.dots.dot import Dot, Patch, SeenPatches
from services.pi_tracker.dots.either import is_cloud
from services.pi_tracker.dots.evidence import Judge
from services.pi_tracker.dots.hindsight import resumed
from services.pi_tracker.dots.hindsight.again import searched_again
from services.pi_tracker.dots.hindsight.weaving import Account, woven
from services.pi_tracker.dots.hypothesis import SHARED
from services.pi_tracker.dots.search import AGAIN, CLOUD, SEVERAL, Search
from services.pi_tracker.dots.tracker import MERGED_QUALITY, DotTracker, arrays_of, seen_alone

# How often each picture is looked at: from the start in each way, and as what hangs on no hand;
# from the middle, and resumed.
LOOKS = len(SEVERAL) + 2 + resumed.LOOKS

Begin = Callable[[Search], DotTracker]


def look_back(
    begin: Begin, pictures: Sequence[SeenPatches], advance: Callable[[], None] = lambda: None
) -> list[dict[str, Dot]]:
    """The dots of all pictures by landmark, empty ones before tracking has started.

    begin makes a tracker that remembers, of the given search; advance is called LOOKS times for
    each picture.
    """
    trackers = _followed(begin, pictures, advance)
    begun, names, cloud = trackers[0].begun, trackers[0].names, trackers[0].is_cloud
    if begun is None:
        return [{} for _ in pictures]
    accounts: list[Account] = [
        dict(enumerate(one.patch for one in tracker.way())) for tracker in trackers
    ]
    count = len(accounts[0])
    seen = pictures[len(pictures) - count :]
    judge = Judge(
        begun,
        [arrays_of(one.patches) for one in seen],
        [one.time_s for one in seen],
        list(accounts[0].values()),
    )
    for _ in range((1 + resumed.LOOKS) * (len(pictures) - count)):
        advance()
    told = woven(judge, accounts, count)
    again = AGAIN._replace(cloud=cloud)
    accounts += searched_again(
        lambda seeds: DotTracker(names, begun.size_px, seeds, again, remembers=True),
        names,
        seen,
        told,
        advance,
        by_shape=not cloud,
    )
    told = resumed.resumed(judge, woven(judge, accounts, count), advance)
    return _dots(names, told, [one.patches for one in pictures])


def _followed(
    begin: Begin, pictures: Sequence[SeenPatches], advance: Callable[[], None]
) -> list[DotTracker]:
    """Trackers that have searched all pictures, each in another way; of no hand if it is none."""
    hand, cloud = begin(SEVERAL[0]), begin(CLOUD)
    since = 0
    for tracker in (hand, cloud):
        for picture in pictures:
            tracker.step(picture.patches, picture.time_s)
            since += tracker is hand and hand.begun is not None
            advance()
    no_hand = is_cloud(hand, cloud, since)
    others = [begin(one._replace(cloud=no_hand)) for one in SEVERAL[1:]]
    for tracker in others:
        for picture in pictures:
            tracker.step(picture.patches, picture.time_s)
            advance()
    return [cloud if no_hand else hand, *others]


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
