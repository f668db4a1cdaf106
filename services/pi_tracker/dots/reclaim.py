"""Lost dots found again where motion does not expect them. Pure.

A finger that curls within a picture or two leaves its dots' gates, and what was missed once is
taken for something else from then on: it is there in every picture. Or each dot takes the patch of
the next one of its finger, which was nearer, and the last one's is left over. Here a patch that
nobody claims, and that came no sooner than a dot was lost, enters accounts beside the others: as
that dot, or as the end of its finger, along which all names move on by one; if bones allow it. The
next pictures decide.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.chains import Chains
from services.pi_tracker.dots.hypothesis import Hypothesis
from services.pi_tracker.dots.shape import strain

Array = npt.NDArray[np.float64]

# A patch of a picture is that of the one before within so many px.
_SAME_PX = 12.0
# Chosen on `grab`, `splay`, `pinch` and `wave` with seeds 0 and 1 of benchmarks/dots.py: right dots
# 98.6 -> 99.0 % (mean of the four), and on seeds 100 and 101 98.7 -> 99.1 %.
# More strain than this, nats, is no hand; areas differ by less than this factor.
_MOST_STRAIN, _AREA_FACTOR = 1.0, 2.5
# The account begins so much less likely (nats) than the one it is made from; or likelier, where it
# leaves no dot without a patch in the very picture in which one was lost, and its bones are as long
# as they were, within this share.
_DOUBT, _CONFIDENCE, _SAME_LENGTH = 2.0, 1.0, 0.15
# Where the dot may be, px, and how fast it may move, in diameters a second.
_PLACE_SIGMA_PX, _SPEED_DIAMETERS = 1.0, 20.0
_MOST = 3


class Unclaimed:
    """For how many pictures each patch that is no dot has been there."""

    def __init__(self) -> None:
        self._places = np.empty((0, 2))
        self._ages = np.empty(0, np.int64)

    def note(self, places: Array) -> npt.NDArray[np.int64]:
        """Ages (k,) of the patches (k, 2) that are no dots in a picture; new ones have 1."""
        ages = np.ones(len(places), np.int64)
        if len(places) and len(self._places):
            squares = np.sum((places[:, None] - self._places[None]) ** 2, axis=2)
            nearest = squares.argmin(axis=1)
            same = squares[np.arange(len(places)), nearest] < _SAME_PX**2
            ages[same] += self._ages[nearest[same]]
        self._places, self._ages = places.copy(), ages
        return ages


def reclaimed(
    best: Hypothesis,
    chains: Chains,
    places: Array,
    areas: Array,
    ages: npt.NDArray[np.int64],
) -> list[Hypothesis]:
    """The best account with a lost dot at a patch that is none: places (m, 2), areas (m,) px^2.

    ages (k,) of the patches that no dot has, in their order.
    """
    free = np.setdiff1d(np.arange(len(areas)), best.patch)
    exact = np.zeros(len(best.patch))
    found: list[tuple[float, Hypothesis]] = []
    for dot in np.flatnonzero(np.array(best.patch) < 0).tolist():
        for patch, age in zip(free.tolist(), ages.tolist(), strict=True):
            if age > best.unseen[dot] + 1:
                continue
            for changes in _changes(best, chains, dot, patch):
                ratios = [areas[to] / best.areas[one] for one, to in changes.items()]
                if not all(1.0 / _AREA_FACTOR < ratio < _AREA_FACTOR for ratio in ratios):
                    continue
                moved = best.state.positions.copy()
                seen = np.array(best.patch) >= 0
                for one, to in changes.items():
                    moved[one], seen[one] = places[to], True
                nats = strain(chains, moved, seen, exact, best.lengths)
                if nats < _MOST_STRAIN:
                    whole = best.unseen[dot] == 1 and bool(seen.all())
                    whole = whole and _as_long(best, chains, changes, moved)
                    odds = _CONFIDENCE if whole else -_DOUBT
                    found.append((nats - odds, _with(best, changes, places, odds)))
    found.sort(key=lambda one: one[0])
    return [one for _, one in found[:_MOST]]


def _changes(best: Hypothesis, chains: Chains, dot: int, patch: int) -> list[dict[int, int]]:
    """New patches by dot: the lost one's alone, or those from it to either end of its finger."""
    ways = [{dot: patch}]
    for step in (chains.bones, chains.bones[:, ::-1]):
        line, now = [dot], dot
        while len(after := step[step[:, 0] == now, 1]) == 1:
            now = int(after[0])
            line.append(now)
        taken = [best.patch[one] for one in line[1:]]
        if taken and min(taken) >= 0:
            ways.append(dict(zip(line, [*taken, patch], strict=True)))
    return ways


def _as_long(best: Hypothesis, chains: Chains, changes: dict[int, int], places: Array) -> bool:
    """Whether the bones at the dots that change are about as long as they ever were."""
    near, far = chains.spans[: len(chains.bones)].T
    changed = np.isin(near, list(changes)) | np.isin(far, list(changes))
    lengths = best.lengths[: len(chains.bones)][changed]
    sizes = np.linalg.norm(places[far] - places[near], axis=1)[changed]
    return bool(np.all(np.abs(sizes / lengths - 1.0) < _SAME_LENGTH))


def _with(best: Hypothesis, changes: dict[int, int], places: Array, odds: float) -> Hypothesis:
    """The account with new patches of some dots, which then move as nobody knows."""
    count = len(best.patch)
    mean, cov, unseen = best.state.mean.copy(), best.state.cov.copy(), best.unseen.copy()
    own = list(best.patch)
    for dot, patch in changes.items():
        mean[dot], mean[count + dot] = places[patch], 0.0
        speed = _SPEED_DIAMETERS * float(np.sqrt(4.0 / np.pi * best.areas[dot]))
        for row, sigma in ((dot, _PLACE_SIGMA_PX), (count + dot, speed)):
            cov[row], cov[:, row] = 0.0, 0.0
            cov[row, row] = sigma**2
        unseen[dot] = 0
        own[dot] = patch
    return replace(
        best,
        score=best.score + odds,
        state=motion.State(mean, cov),
        unseen=unseen,
        patch=tuple(own),
        false=np.delete(places, [patch for patch in own if patch >= 0], axis=0),
    )
