"""One account of which dot was which patch so far, and how well it goes on with the next picture.

After Reid, An Algorithm for Tracking Multiple Targets (IEEE Trans. Automatic Control 24, 1979):
several accounts are kept, each is extended by the likely assignments of a picture, and what was
decided wrongly is undone as soon as later pictures speak against it (tracker.py). The score is a
log likelihood: of the hand's posture and motion (motion.py), of what is missing and what is false.
Pure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.body.body import Body
from services.pi_tracker.dots.search import Search

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

# Probability that a dot is found in a picture: where it was in the last one, where it was not, and
# where its skin faces away; it does at the first of these cosines, and shows well at the second.
# (On the clips of skeleton.py: -.1 and .4 88 % right, 92 % so; of those that face away .2 found 88,
# .4 87 %.)
_FOUND, _FOUND_AGAIN, _FACES_AWAY, _TURNED = 0.97, 0.6, 0.1, (-0.4, 0.3)
# What was hidden stays so: from picture to picture it is expected so much less. Else a fist that
# shows three dots is turned until the others face away. (Those of the tuning half of
# benchmarks/dots_pictures.py that are lost at times, 6 clips of 8 dots and 5 of 15: 93.7 and 80.8 %
# right, 1.0 and 3.5 % exchanged; with .8 93.8 and 80.6, with .5 92.4 and 81.4, 1.8 and 2.9.)
_STAYS = 0.65
# Of each picture so many patches that are no dots, at least.
FEWEST_FALSE = 0.1
# Where a dot lies behind or beside another's it shares that one's patch, with this probability.
_MERGED = float(np.log(0.8))
# A patch that was no dot is still there in the next picture with this probability, and within so
# many px (sigma) of where it was.
_STILL_FALSE, _FALSE_STEP_PX = 0.9, 6.0
# Dots move on the skin, and light on the paint, and no hand is quite the model's: sigma as a share
# of a dot's diameter (with an earlier search .16: 99.5, 98.5, 98.9 % of `grab` right, seeds 0, 2, 4
# of benchmarks/dots.py; .12: 96.6, 98.6, 99.5 %). Of the centre of a patch that several dots share,
# at least.
_WANDER, SHARED = 0.16, 0.35
# Where half a disc is hidden its centre moves by .24 of the root of its area, as in
# detect/marker_finder.py; areas vary by less than the second without anything being hidden.
HIDDEN, AREA_NOISE = 0.34, 0.25
# A dot's area varies by so much (sigma of its logarithm) below and above what it was of late, and
# no patch is judged by more than so many nats on it.
_AREA_SIGMA, _AREA_NATS = (0.45, 0.2), (2.0, 4.0)
# No account is kept that is so much (nats) less likely than the best.
_WORSE_NATS = 14.0
# Weight of a new area.
_AREA_WEIGHT = 0.1


class Patches(NamedTuple):
    """The m patches of a picture."""

    places: Array  # (m, 2)
    areas: Array  # (m,)
    sigmas: Array  # (m,)
    wholes: Indices  # (m,) -1 of one that is no part
    whole_places: Array  # (m, 2)


@dataclass(frozen=True)
class Surroundings:
    """What all accounts share."""

    body: Body
    # What accelerations add to a covariance, and the log probability of each: at rest first.
    levels: tuple[tuple[Array, float], ...]
    false_density: float  # patches that are no dots, per px^2


class Known(NamedTuple):
    """What a view needs to know of an account; a Hypothesis is one, too."""

    score: float
    areas: Array  # (n,) px^2
    unseen: Indices  # (n,) pictures in a row in which each was not seen
    false: Array  # (k, 2) patches of the last picture that are no dots


class Way(NamedTuple):
    """What an account said of a picture, and of those before."""

    before: Way | None
    patch: tuple[int, ...]  # of each dot, -1 for none


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One account of n dots after a picture."""

    score: float
    state: motion.State  # one
    branch: int  # which of the postures at the start it came from
    areas: Array  # (n,) px^2
    unseen: Indices  # (n,) pictures in a row in which each was not seen
    patch: tuple[int, ...]  # of each dot in the last picture, -1 for none
    before: tuple[int, ...]  # in the one before
    false: Array  # (k, 2) patches of the last picture that are no dots
    # Of all pictures so far, where they are looked back at; it grows with each.
    way: Way | None = None


class View:
    """A hypothesis looking at the next picture: assignments, and how likely each is."""

    def __init__(
        self, parent: Hypothesis | Known, patches: Patches, false_density: float, showing: Array
    ) -> None:
        """showing (n,) is how far each dot is turned to the camera (skeleton.py)."""
        self.parent, self.patches = parent, patches
        shows = np.clip((showing - _TURNED[0]) / (_TURNED[1] - _TURNED[0]), 0.0, 1.0)
        again = _FACES_AWAY + (_FOUND_AGAIN - _FACES_AWAY) * _STAYS ** (parent.unseen - 1.0)
        found = np.where(parent.unseen == 0, _FOUND, again)
        found = _FACES_AWAY + shows * (found - _FACES_AWAY)
        self._found, self._missed = np.log(found), np.log1p(-found)
        false = _false_density(patches.places, parent.false, false_density)
        # The parts of a blob are false together, as one.
        part = patches.wholes >= 0
        parts = np.count_nonzero(patches.wholes[:, None] == patches.wholes[None], axis=1)
        self._false = np.where(part, false / np.maximum(parts, 1), false)
        diameters = np.sqrt(4.0 / np.pi * parent.areas)
        self._diameters = diameters
        # (n, m): the log likelihood of the areas, and each measurement's variance.
        ratio = np.log(patches.areas[None] / parent.areas[:, None])
        self._area_nats = np.where(
            ratio < 0.0,
            np.minimum(0.5 * (ratio / _AREA_SIGMA[0]) ** 2, _AREA_NATS[0]),
            np.minimum(0.5 * (ratio / _AREA_SIGMA[1]) ** 2, _AREA_NATS[1]),
        )
        hidden = np.clip(1.0 - np.exp(ratio), 0.0, 0.9)
        hidden[hidden < AREA_NOISE] = 0.0
        offset = HIDDEN * hidden * np.sqrt(parent.areas)[:, None]
        # (n, m): of each patch as a dot's; (n,): what is added where it shares one.
        self.variances = patches.sigmas[None] ** 2 + (_WANDER * diameters[:, None]) ** 2
        self.variances += offset**2
        self.sharing = (SHARED * diameters) ** 2

    def alone(self) -> Array:
        """What each dot gains by each patch over being missing, but for where it is, (n, m)."""
        return (self._found - self._missed)[:, None] - self._false - self._area_nats

    def beside(self) -> Array:
        """What each dot gains by a patch that another has, too, but for where it is, (n,)."""
        within = np.pi * (0.8 * self._diameters) ** 2
        gains = self._found - self._missed + _MERGED - np.log(_FOUND) + np.log(within)
        return np.asarray(gains)

    def claims(self, patch: Indices) -> float:
        """The score, but for where dots are: of claiming patches that would be false ones."""
        dots, shared = np.flatnonzero(patch >= 0), self._shared(patch)
        nats = self.parent.score + float(self._missed[patch < 0].sum())
        if not len(dots):
            return nats
        claimed = np.unique(patch[dots])
        nats += float(self._found[dots].sum()) - float(self._false[claimed].sum())
        alone = dots[~shared[dots]]
        nats -= float(self._area_nats[alone, patch[alone]].sum())
        extra = len(dots) - len(claimed)
        if extra:
            # The second dot of a patch has no density of its own: it is there with a probability.
            both = dots[shared[dots]]
            within = np.pi * (0.8 * self._diameters[both]) ** 2
            nats += extra * (_MERGED - float(np.log(_FOUND)) + float(np.log(within).mean()))
        return nats

    def measured(self, patch: Indices) -> tuple[Mask, Array, Array]:
        """Which dots (n,) an assignment measures, their places (n, 2) and variances (n,)."""
        seen, shared = patch >= 0, self._shared(patch)
        dots = np.flatnonzero(seen)
        places, variances = np.zeros((len(patch), 2)), np.ones(len(patch))
        places[dots] = self.patches.places[patch[dots]]
        variances[dots] = self.variances[dots, patch[dots]]
        variances[shared] += self.sharing[shared]
        # A part of which the others are nobody's is no part.
        wholes = self.patches.wholes[patch[dots]]
        for dot, whole in zip(dots.tolist(), wholes.tolist(), strict=True):
            if whole >= 0 and np.count_nonzero(wholes == whole) == 1:
                places[dot] = self.patches.whole_places[patch[dot]]
                variances[dot] += (0.25 * self._diameters[dot]) ** 2
        return seen, places, variances

    def become(
        self, parent: Hypothesis, patch: Indices, state: motion.State, nats: float
    ) -> Hypothesis:
        """What a hypothesis becomes by an assignment, with its state and likelihood of places."""
        missed = patch < 0
        areas, alone = parent.areas.copy(), ~missed & ~self._shared(patch)
        areas[alone] += _AREA_WEIGHT * (self.patches.areas[patch[alone]] - areas[alone])
        score, told, way = self.claims(patch) + nats, tuple(patch.tolist()), parent.way
        return Hypothesis(
            score=score,
            state=state,
            branch=parent.branch,
            areas=areas,
            unseen=np.where(missed, parent.unseen + 1, 0),
            patch=told,
            before=parent.patch,
            false=np.delete(self.patches.places, patch[~missed], axis=0),
            way=None if way is None else Way(way, told),
        )

    def _shared(self, patch: Indices) -> Mask:
        """Which dots (n,) share their patch."""
        counts = np.bincount(patch[patch >= 0], minlength=len(self.patches.areas) or 1)
        return np.asarray((patch >= 0) & (counts[patch] > 1))


def pruned(hypotheses: list[Hypothesis], search: Search) -> list[Hypothesis]:
    """The best, best first; few of those that agree in two pictures."""
    kept: list[Hypothesis] = []
    alike: dict[tuple[tuple[int, ...], tuple[int, ...]], set[int]] = {}
    for one in sorted(hypotheses, key=lambda one: -one.score):
        branches = alike.setdefault((one.patch, one.before), set())
        if one.branch not in branches and len(branches) < search.alike:
            branches.add(one.branch)
            kept.append(one)
        if len(kept) >= search.kept:
            break
    best = kept[0].score
    return [one for one in kept if one.score - best > -_WORSE_NATS]


def rescored(hypotheses: list[Hypothesis]) -> list[Hypothesis]:
    """The same, best first, with the best score 0."""
    ordered = sorted(hypotheses, key=lambda one: -one.score)
    return [replace(one, score=one.score - ordered[0].score) for one in ordered]


def _false_density(places: Array, before: Array, density: float) -> Array:
    """Log density (m,) per px^2 of patches that are no dots, given those (k, 2) that were none."""
    if not len(before):
        return np.full(len(places), float(np.log(density)))
    squares = np.sum((places[:, None] - before[None]) ** 2, axis=2) / _FALSE_STEP_PX**2
    peak = _STILL_FALSE / (2.0 * np.pi * _FALSE_STEP_PX**2)
    return np.asarray(np.log(density + peak * np.exp(-0.5 * squares).sum(axis=1)))
