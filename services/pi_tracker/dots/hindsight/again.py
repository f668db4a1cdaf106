"""Searches of a recording that begin in the middle of it, forwards and backwards. Pure.

A search that has lost the posture of a hand does not find it again by itself. One that begins where
every dot is seen alone tries all postures that this picture allows; and a fist that closed too fast
for one direction opens in the other. It begins with the names that dots are believed to have there,
and with those that their shape says, as where nobody gave seeds, if they are others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from services.pi_tracker.dots.chains import Chains, chains_of
from services.pi_tracker.dots.dot import Patch, SeenPatches
from services.pi_tracker.dots.evidence import Told
from services.pi_tracker.dots.start.constellation import guess
from services.pi_tracker.dots.tracker import DotTracker

# Of so many pictures, one is begun with; and so many before and after it are searched. (A reach of
# 100 pictures leaves 98.7 % right of `grab`, seed 28 of benchmarks/dots.py, instead of 99.8.)
_BLOCK, _REACH = 40, 160


def searched_again(
    begin: Callable[[dict[str, tuple[float, float]]], DotTracker],
    names: Sequence[str],
    pictures: Sequence[SeenPatches],
    told: Sequence[Told],
    advance: Callable[[], None],
    *,
    by_shape: bool = True,
) -> list[dict[int, Told]]:
    """Accounts that begin with names of `told`, or by shape, by the numbers of their pictures.

    begin makes a tracker that remembers, of seeds; names are those of the dots of told. by_shape:
    whether these are a hand's, whose shape says which is which.
    """
    chains = chains_of(names)
    accounts: list[dict[int, Told]] = []
    for first in range(0, len(pictures), _BLOCK):
        block = range(first, min(first + _BLOCK, len(pictures)))
        for number, own in _begun(chains, pictures, told, block, by_shape):
            patches = pictures[number].patches
            seeds = {n: _place(patches[p]) for n, p in zip(names, own, strict=True)}
            ahead = range(number, min(number + _REACH, len(pictures)))
            back = range(number, max(number - _REACH, -1), -1)
            accounts.append(
                _account(begin(seeds), pictures, back, own)
                | _account(begin(seeds), pictures, ahead, own)
            )
        for _ in block:
            advance()
    return accounts


def _begun(
    chains: Chains,
    pictures: Sequence[SeenPatches],
    told: Sequence[Told],
    block: range,
    by_shape: bool,
) -> list[tuple[int, Told]]:
    """Pictures of a block to begin with, and the patches that dots are taken to have there."""
    begun = []
    number = _clearest(pictures, {k: told[k] for k in block})
    if number is not None:
        begun.append((number, told[number]))
    if not by_shape:
        return begun
    # Names that are lost for good are found again by shape.
    count = len(chains.landmarks)
    every = {k: tuple(range(count)) for k in block if len(pictures[k].patches) == count}
    number = _clearest(pictures, every)
    if number is not None:
        places = np.array([_place(patch) for patch in pictures[number].patches])
        likely = guess(chains, places)
        if likely is not None and likely.patch != told[number]:
            begun.append((number, likely.patch))
    return begun


def _clearest(pictures: Sequence[SeenPatches], told: Mapping[int, Told]) -> int | None:
    """The picture in which dots are furthest apart, of those told that show each alone."""
    best, widest = None, 0.0
    for number, own in told.items():
        if min(own) < 0 or len(set(own)) < len(own):
            continue
        places = np.array([_place(pictures[number].patches[p]) for p in own])
        apart = np.linalg.norm(places[:, None] - places[None], axis=2)
        least = float(apart[~np.eye(len(own), dtype=bool)].min(initial=np.inf))
        if least > widest:
            best, widest = number, least
    return best


def _account(
    tracker: DotTracker, pictures: Sequence[SeenPatches], numbers: range, first: Told
) -> dict[int, Told]:
    """What a tracker says of pictures in an order; time goes on, whatever their order."""
    for number in numbers:
        tracker.step(pictures[number].patches, numbers.step * pictures[number].time_s)
    way = [one.patch for one in tracker.way()]
    return dict(zip(numbers, way, strict=True)) if way[:1] == [first] else {}


def _place(patch: Patch) -> tuple[float, float]:
    return patch.x_px, patch.y_px
