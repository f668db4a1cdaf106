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
from services.pi_tracker.dots.skeleton import Skeleton

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

# Probability that a dot is found in a picture: where it was in the last one, and where it was not.
_FOUND, _FOUND_AGAIN = 0.97, 0.6
# Where a dot lies behind or beside another's it shares that one's patch, with this probability.
_MERGED = float(np.log(0.8))
# A patch that was no dot is still there in the next picture with this probability, and within so
# many px (sigma) of where it was.
_STILL_FALSE, _FALSE_STEP_PX = 0.9, 6.0
# Dots move on the skin, and light on the paint, and no hand is quite the model's: sigma as a share
# of a dot's diameter (.16: 99.5, 98.5, 98.9 % of `grab` right, seeds 0, 2, 4 of benchmarks/dots.py;
# .12: 96.6, 98.6, 99.5 %). Of the centre of a patch that several dots share, at least.
_WANDER, _SHARED = 0.16, 0.35
# Where half a disc is hidden its centre moves by .24 of the root of its area, as in
# detect/marker_finder.py; areas vary by less than the second without anything being hidden.
_HIDDEN, _AREA_NOISE = 0.34, 0.25
# A dot's area varies by so much (sigma of its logarithm) below and above what it was of late, and
# no patch is judged by more than so many nats on it.
_AREA_SIGMA, _AREA_NATS = (0.45, 0.2), (2.0, 4.0)
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

    skeleton: Skeleton
    # What accelerations add to a covariance, and the log probability of each: at rest first.
    levels: tuple[tuple[Array, float], ...]
    false_density: float  # patches that are no dots, per px^2


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


class Ahead(NamedTuple):
    """Where an account's dots are expected: pixels (n, 2), their covariance (2n, 2n), its state."""

    places: Array
    cov: Array
    state: motion.State


class View:
    """A hypothesis looking at the next picture: assignments, and how likely each is."""

    def __init__(
        self,
        parent: Hypothesis,
        ahead: Ahead,
        patches: Patches,
        false_density: float,
        prior: float,
    ) -> None:
        """prior: log probability of the acceleration that `ahead` has."""
        self.parent, self.ahead, self.patches, self.prior = parent, ahead, patches, prior
        found = np.where(parent.unseen == 0, _FOUND, _FOUND_AGAIN)
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
        hidden[hidden < _AREA_NOISE] = 0.0
        offset = _HIDDEN * hidden * np.sqrt(parent.areas)[:, None]
        self._variances = patches.sigmas[None] ** 2 + (_WANDER * diameters[:, None]) ** 2
        self._variances += offset**2
        least = (_WANDER * diameters) ** 2
        self._least = self._variances.min(axis=1) if len(patches.areas) else least

    def gains(self, places: Array, covs: Array) -> Array:
        """What each dot gains by each patch over being missing, nats (n, m).

        places (n, 2) and covs (n, 2, 2): where each is expected, and the covariance of that and of
        a measurement.
        """
        away = self.patches.places[None] - places[:, None]  # (n, m, 2)
        more = self._variances - self._least[:, None]
        xx, xy, yy = covs[:, :1, 0] + more, covs[:, :1, 1], covs[:, 1:, 1] + more
        det = xx * yy - xy**2
        x, y = away[..., 0], away[..., 1]
        squares = (yy * x**2 - 2.0 * xy * x * y + xx * y**2) / det
        gains = -0.5 * (squares + np.log(det)) - np.log(2.0 * np.pi) - self._area_nats
        gains += (self._found - self._missed)[:, None] - self._false
        return np.asarray(gains)

    def marginal(self) -> tuple[Array, Array]:
        """Where each dot is expected by the past alone, (n, 2), and the covariance (n, 2, 2)."""
        return self.ahead.places, self._own(self.ahead.cov)

    def given(self, patch: Indices) -> tuple[Array, Array]:
        """The same by an assignment of all the other dots; of a measured dot, without its own."""
        dots = np.flatnonzero(patch >= 0)
        if not len(dots):
            return self.marginal()
        residuals, inverse = self._innovation(dots, patch)
        cross = self.ahead.cov[:, _pairs(dots)]
        gain = cross @ inverse
        places = self.ahead.places + (gain @ residuals).reshape(-1, 2)
        covs = self._own(self.ahead.cov - gain @ cross.T)
        blocks = np.linalg.inv(_blocks(inverse))
        measured = self.ahead.places[dots] + residuals.reshape(-1, 2)
        left_out = (blocks @ (inverse @ residuals).reshape(-1, 2, 1))[..., 0]
        places[dots], covs[dots] = measured - left_out, blocks
        return places, covs

    def with_merged(self, patch: Indices) -> Indices:
        """The assignment, with dots that have no patch on one that they share with another."""
        free = np.flatnonzero(patch < 0)
        taken = np.unique(patch[patch >= 0])
        if not len(free) or not len(taken):
            return patch
        places, covs = self.given(patch)
        away = self.patches.places[taken][None] - places[free][:, None]
        spread = 0.5 * (covs[free, 0, 0] + covs[free, 1, 1])[:, None]
        diameters = self._diameters[free][:, None]
        # The probability that a dot expected so lies within about a dot of another one.
        inside = np.minimum(0.5 * (0.8 * diameters) ** 2 / spread, 1.0)
        squares = np.sum(away**2, axis=2) / np.maximum(spread, (_SHARED * diameters) ** 2)
        gain = _MERGED + np.log(inside) - 0.5 * squares - self._missed[free][:, None]
        best = gain.argmax(axis=1)
        merged = gain[np.arange(len(free)), best] > 0.0
        result = patch.copy()
        result[free[merged]] = taken[best[merged]]
        return result

    def roughly(self, patch: Indices) -> tuple[float, float]:
        """The score of an assignment, and its squared innovation for each degree of freedom.

        Linearised where the dots are expected.
        """
        score, dots = self.claims(patch), np.flatnonzero(patch >= 0)
        if not len(dots):
            return score, 1.0
        residuals, inverse = self._innovation(dots, patch)
        squared = float(residuals @ inverse @ residuals)
        score += 0.5 * float(np.linalg.slogdet(inverse)[1]) - 0.5 * squared
        return score - len(dots) * float(np.log(2.0 * np.pi)), squared / (2 * len(dots))

    def claims(self, patch: Indices) -> float:
        """The score, but for where dots are: of claiming patches that would be false ones."""
        dots, shared = np.flatnonzero(patch >= 0), self._shared(patch)
        nats = self.parent.score + self.prior + float(self._missed[patch < 0].sum())
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
        variances[dots] = self._variances[dots, patch[dots]]
        variances[shared] += (_SHARED * self._diameters[shared]) ** 2
        # A part of which the others are nobody's is no part.
        wholes = self.patches.wholes[patch[dots]]
        for dot, whole in zip(dots.tolist(), wholes.tolist(), strict=True):
            if whole >= 0 and np.count_nonzero(wholes == whole) == 1:
                places[dot] = self.patches.whole_places[patch[dot]]
                variances[dot] += (0.25 * self._diameters[dot]) ** 2
        return seen, places, variances

    def become(self, patch: Indices, state: motion.State, nats: float) -> Hypothesis:
        """The hypothesis that an assignment leads to, with its state and likelihood of places."""
        missed = patch < 0
        areas, alone = self.parent.areas.copy(), ~missed & ~self._shared(patch)
        areas[alone] += _AREA_WEIGHT * (self.patches.areas[patch[alone]] - areas[alone])
        return Hypothesis(
            score=self.claims(patch) + nats,
            state=state,
            branch=self.parent.branch,
            areas=areas,
            unseen=np.where(missed, self.parent.unseen + 1, 0),
            patch=tuple(patch.tolist()),
            before=self.parent.patch,
            false=np.delete(self.patches.places, patch[~missed], axis=0),
        )

    def _shared(self, patch: Indices) -> Mask:
        """Which dots (n,) share their patch."""
        counts = np.bincount(patch[patch >= 0], minlength=len(self.patches.areas) or 1)
        return np.asarray((patch >= 0) & (counts[patch] > 1))

    def _innovation(self, dots: Indices, patch: Indices) -> tuple[Array, Array]:
        """Residuals (2m,) of m dots, and the inverse of their covariance."""
        _, places, variances = self.measured(patch)
        own = _pairs(dots)
        cov = self.ahead.cov[own[:, None], own] + np.diag(np.repeat(variances[dots], 2))
        residuals = (places - self.ahead.places)[dots].ravel()
        return residuals, np.asarray(np.linalg.inv(cov), np.float64)

    def _own(self, cov: Array) -> Array:
        """Each dot's covariance (n, 2, 2), a measurement's included."""
        return _blocks(cov) + self._least[:, None, None] * np.eye(2)


def _pairs(dots: Indices) -> Indices:
    """Rows of x and y of each dot."""
    return np.asarray((2 * dots[:, None] + np.arange(2)).ravel(), np.int64)


def _blocks(matrix: Array) -> Array:
    """The (2, 2) blocks on the diagonal of a matrix (2n, 2n)."""
    count = len(matrix) // 2
    return np.asarray(matrix.reshape(count, 2, count, 2)[np.arange(count), :, np.arange(count)])


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
