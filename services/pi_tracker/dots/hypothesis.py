"""One account of which dot was which patch so far, and how well it goes on with the next picture.

After Reid, An Algorithm for Tracking Multiple Targets (IEEE Trans. Automatic Control 24, 1979):
several accounts are kept, each is extended by the likely assignments of a picture, and what was
decided wrongly is undone as soon as later pictures speak against it (tracker.py). The score is a
log likelihood: of the motion, of what is missing and what is false, and of bones that do not grow.
Pure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.chains import Chains
from services.pi_tracker.dots.shape import strain

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# Probability that a dot is found in a picture: where it was in the last one, and where it was not.
_FOUND, _FOUND_AGAIN = 0.97, 0.6
# Where a dot lies behind or beside another's it shares that one's patch, with this probability.
_MERGED = float(np.log(0.8))
# A patch that was no dot is still there in the next picture with this probability, and within so
# many px (sigma) of where it was.
_STILL_FALSE, _FALSE_STEP_PX = 0.9, 6.0
# Paint moves on the skin, and light on the paint: sigma as a share of a dot's diameter. Of the
# centre of a patch that several dots share, at least.
_WANDER, _SHARED = 0.05, 0.35
# Where half a disc is hidden its centre moves by .24 of the root of its area, as in
# detect/marker_finder.py; areas vary by less than the second without anything being hidden.
_HIDDEN, _AREA_NOISE = 0.34, 0.25
# A dot's area varies by so much (sigma of its logarithm) below and above what it was of late, and
# no patch is judged by more than so many nats on it.
_AREA_SIGMA, _AREA_NATS = (0.45, 0.2), (2.0, 4.0)
# Weight of a longer length in a bone's longest one; a shorter one counts after this time (the hand
# goes away from the camera).
_LONGER_WEIGHT, _LENGTH_MEMORY_S = 0.3, 10.0
# No bone is so many times longer than the others say by an average adult's proportions.
_LONGEST_RATIO = 1.4
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

    chains: Chains
    # The hand's acceleration, px/s^2: as of late first, then sharper ones; log probability of each.
    accelerations: tuple[tuple[float, float], ...]
    false_density: float  # patches that are no dots, per px^2


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One account of n dots after a picture."""

    score: float
    state: motion.State
    lengths: Array  # (b,) the longest each bone was, px
    areas: Array  # (n,) px^2
    unseen: Indices  # (n,) pictures in a row in which each was not seen
    patch: tuple[int, ...]  # of each dot in the last picture, -1 for none
    before: tuple[int, ...]  # in the one before
    false: Array  # (k, 2) patches of the last picture that are no dots
    squared: float = 0.0  # innovation squared for each of its degrees of freedom


class View:
    """A hypothesis looking at the next picture: assignments, and how likely each is."""

    def __init__(
        self,
        parent: Hypothesis,
        patches: Patches,
        around: Surroundings,
        elapsed_s: float,
        acceleration_px_s2: float,
        prior: float,
    ) -> None:
        """acceleration_px_s2: the hand's; prior: log probability of that."""
        self.parent, self.patches, self._around = parent, patches, around
        self._elapsed_s, self._prior = elapsed_s, prior
        acceleration = acceleration_px_s2**2 * around.chains.acceleration
        state = motion.predict(parent.state, elapsed_s, acceleration)
        self.state = motion.bound_bones(state, around.chains.spans, 1.2 * parent.lengths)
        found = np.where(parent.unseen == 0, _FOUND, _FOUND_AGAIN)
        self._found, self._missed = np.log(found), np.log1p(-found)
        false = _false_density(patches.places, parent.false, around.false_density)
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
        hidden[hidden < _AREA_NOISE] = 0.0
        offset = _HIDDEN * hidden * np.sqrt(parent.areas)[:, None]
        self._variances = patches.sigmas[None] ** 2 + (_WANDER * diameters[:, None]) ** 2
        self._variances += offset**2

    def gains(self, places: Array, spreads: Array) -> Array:
        """What each dot gains by each patch over being missing, nats (n, m).

        places (n, 2) and spreads (n,): where each is expected, and the variance of that and of a
        measurement.
        """
        away = self.patches.places[None] - places[:, None]  # (n, m, 2)
        squares = np.sum(away**2, axis=2)
        spread = spreads[:, None] + self._variances - self._variances.min(axis=1, keepdims=True)
        gains = -0.5 * squares / spread - np.log(2.0 * np.pi * spread) - self._area_nats
        gains += (self._found - self._missed)[:, None] - self._false
        return np.asarray(gains)

    def marginal(self) -> tuple[Array, Array]:
        """Where each dot is expected by the past alone, (n, 2), and the variance (n,)."""
        count = len(self._found)
        return self.state.positions, np.diag(self.state.cov)[:count] + self._least_variances()

    def given(self, patch: Indices) -> tuple[Array, Array]:
        """The same by an assignment of all the other dots."""
        dots = np.flatnonzero(patch >= 0)
        if not len(dots):
            return self.marginal()
        innovation = self._innovation(dots, patch)
        return motion.expected(self.state, innovation, self._least_variances())

    def with_merged(self, patch: Indices) -> Indices:
        """The assignment, with dots that have no patch on one that they share with another."""
        free = np.flatnonzero(patch < 0)
        taken = np.unique(patch[patch >= 0])
        if not len(free) or not len(taken):
            return patch
        places, spreads = self.given(patch)
        away = self.patches.places[taken][None] - places[free][:, None]
        spread = spreads[free][:, None]
        # The probability that a dot expected so lies within about a dot of another one.
        inside = np.minimum(0.5 * (0.8 * self._diameters[free][:, None]) ** 2 / spread, 1.0)
        gain = (
            _MERGED
            + np.log(inside)
            - 0.5
            * np.sum(away**2, axis=2)
            / np.maximum(spread, (_SHARED * self._diameters[free][:, None]) ** 2)
        )
        gain -= self._missed[free][:, None]
        best = gain.argmax(axis=1)
        merged = gain[np.arange(len(free)), best] > 0.0
        result = patch.copy()
        result[free[merged]] = taken[best[merged]]
        return result

    def extended(self, patch: Indices) -> Hypothesis:
        """The hypothesis that this assignment leads to."""
        dots = np.flatnonzero(patch >= 0)
        missed = patch < 0
        score = self.parent.score + self._prior + float(self._missed[missed].sum())
        state, squared = self.state, 1.0
        shared = self._shared(patch)
        if len(dots):
            innovation = self._innovation(dots, patch)
            score += innovation.log_likelihood + self._claims(dots, patch, shared)
            state = motion.update(state, innovation)
            squared = innovation.squared / (2 * len(dots))
        lengths, nats = self._lengths(patch, shared)
        seen = ~missed & ~shared
        areas = self.parent.areas.copy()
        areas[seen] += _AREA_WEIGHT * (self.patches.areas[patch[seen]] - areas[seen])
        return Hypothesis(
            score=score - nats,
            state=state,
            lengths=lengths,
            areas=areas,
            unseen=np.where(missed, self.parent.unseen + 1, 0),
            patch=tuple(patch.tolist()),
            before=self.parent.patch,
            false=np.delete(self.patches.places, patch[dots], axis=0),
            squared=squared,
        )

    def _claims(self, dots: Indices, patch: Indices, shared: npt.NDArray[np.bool_]) -> float:
        """Log likelihood of claiming patches that would be false ones otherwise."""
        claimed = np.unique(patch[dots])
        nats = float(self._found[dots].sum()) - float(self._false[claimed].sum())
        alone = dots[~shared[dots]]
        nats -= float(self._area_nats[alone, patch[alone]].sum())
        extra = len(dots) - len(claimed)
        if extra:
            # The second dot of a patch has no density of its own: it is there with a probability.
            both = dots[shared[dots]]
            within = np.pi * (0.8 * self._diameters[both]) ** 2
            nats += extra * (_MERGED - float(np.log(_FOUND)) + float(np.log(within).mean()))
        return nats

    def _shared(self, patch: Indices) -> npt.NDArray[np.bool_]:
        """Which dots (n,) share their patch."""
        counts = np.bincount(patch[patch >= 0], minlength=len(self.patches.areas) or 1)
        return np.asarray((patch >= 0) & (counts[patch] > 1))

    def _measured(self, dots: Indices, patch: Indices) -> tuple[Array, Array]:
        """Measured places (m, 2) of dots and their variances (m,)."""
        own = patch[dots]
        places, variances = self.patches.places[own].copy(), self._variances[dots, own].copy()
        shared = self._shared(patch)[dots]
        variances[shared] += (_SHARED * self._diameters[dots[shared]]) ** 2
        # A part of which the others are nobody's is no part.
        wholes = self.patches.wholes[own]
        for number in np.flatnonzero(wholes >= 0).tolist():
            if np.count_nonzero(wholes == wholes[number]) == 1:
                places[number] = self.patches.whole_places[own[number]]
                variances[number] += (0.25 * self._diameters[dots[number]]) ** 2
        return places, variances

    def _innovation(self, dots: Indices, patch: Indices) -> motion.Innovation:
        return motion.innovate(self.state, dots, *self._measured(dots, patch))

    def _least_variances(self) -> Array:
        return np.asarray(self._variances.min(axis=1))

    def _lengths(self, patch: Indices, shared: npt.NDArray[np.bool_]) -> tuple[Array, float]:
        """The bones' longest lengths with this assignment, and what it costs to be longer."""
        chains = self._around.chains
        lengths = self.parent.lengths * float(np.exp(-self._elapsed_s / _LENGTH_MEMORY_S))
        seen = patch >= 0
        if not seen.any():
            return lengths, 0.0
        places = self.patches.places[patch]
        unsure = np.where(shared, self._diameters, 0.0)
        nats = strain(chains, places, seen, unsure, self.parent.lengths)
        near, far = chains.spans[:, 0], chains.spans[:, 1]
        alone = seen & ~shared
        bones = places[far] - places[near]
        longer = np.maximum(np.hypot(bones[:, 0], bones[:, 1]) - lengths, 0.0)
        lengths += _LONGER_WEIGHT * longer * (alone[near] & alone[far])
        if len(lengths) > 2:
            usual = float(np.median(lengths / chains.spans_m))
            lengths = np.minimum(lengths, _LONGEST_RATIO * usual * chains.spans_m)
        return lengths, nats


def normalised(hypotheses: list[Hypothesis]) -> list[Hypothesis]:
    """The same with the best score 0."""
    best = max(one.score for one in hypotheses)
    return [replace(one, score=one.score - best) for one in hypotheses]


def _false_density(places: Array, before: Array, density: float) -> Array:
    """Log density (m,) per px^2 of patches that are no dots, given those (k, 2) that were none."""
    if not len(before):
        return np.full(len(places), float(np.log(density)))
    squares = np.sum((places[:, None] - before[None]) ** 2, axis=2) / _FALSE_STEP_PX**2
    peak = _STILL_FALSE / (2.0 * np.pi * _FALSE_STEP_PX**2)
    return np.asarray(np.log(density + peak * np.exp(-0.5 * squares).sum(axis=1)))
