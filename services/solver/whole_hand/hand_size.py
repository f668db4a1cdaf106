"""The size of a hand that nobody measured, from how well its landmarks fit at other sizes.

Whoever is asked guesses a size to some percent, or leaves it at an adult's; 5 % are some 30 deg of
a finger that is nearly straight. Wrist and tips show it: too short fingers do not reach, and too
long ones bend where the others' habit says that they do not. So the hand is fitted now and then as
if nothing had been seen before, at its size and at one a little smaller and larger; the costs are a
parabola over the logarithm of the size (a look). Looks are averaged: habit and bones that err in
one posture err in many, so all looks together know little more than a few.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.chains import HandChains, resized
from services.solver.whole_hand.fit import MAX_ITERATIONS, fit
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.landmarks import (
    Observations,
    Observed,
    resized_offsets,
    whitening,
)
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS, PosePrior
from services.solver.whole_hand.residuals import Pose

# Standard deviation of a guess.
GUESS = 0.05
# What all looks err by together, one standard deviation: a hand's bones are not the tables', and
# habits not everybody's. (Leap recordings, OpenXR poses and simulated hands of other bones, of the
# size of the fingers' bones: .02 to .03.)
_ALIKE = 0.02
# What bones and paint put between a landmark and the model's, one standard deviation.
_SHAPE_M = 2e-3
# How far apart sizes are compared, and the farthest that one look may move the size.
_APART, _FARTHEST = 0.03, 0.1
# Looks are so far apart, in time and in the hand's shape (distances between its landmarks, RMS): a
# hand that is held says the same again. The mean remembers so many.
_INTERVAL_S, _UNLIKE_M, _REMEMBERED = 0.3, 5e-3, 60
# Landmarks that show a size; and of another hand, after one was lost, so many looks are kept: it
# may be somebody else's.
_LANDMARKS, _KEPT = 5, 2
# A smaller change of the size is not worth a change of the hand; a hand that is a third larger or a
# fourth smaller than the guess is a rig's calibration that is wrong, or points that are no hand's.
_LEAST_CHANGE, _MOST = 1e-3, 0.3


class HandSize:
    """What is learned of one hand's size against the guess."""

    def __init__(self, told_m2: float) -> None:
        """told_m2: what landmarks' variances have for the model's."""
        self.factor = 1.0
        self._more_m2 = _SHAPE_M**2 - told_m2
        self._looks = 0
        self._stamp_ns, self._shape_m = 0, np.empty(0)
        # Means over the looks: information, and information times the logarithm that it speaks for.
        self._information, self._pull = 0.0, 0.0

    def lost(self) -> None:
        """The next hand may be somebody else's."""
        self._looks = min(self._looks, _KEPT)

    def is_due(self, stamp_ns: int, observed: Observed) -> bool:
        """Whether a message's landmarks are worth a look; if so, it counts as taken."""
        seconds = 1e-9 * (stamp_ns - self._stamp_ns)
        if 0.0 <= seconds < _INTERVAL_S or len(observed) < _LANDMARKS:
            return False
        a, b = np.triu_indices(len(observed), 1)
        shape_m = np.linalg.norm(observed.points_m[a] - observed.points_m[b], axis=1)
        comparable = shape_m.size == self._shape_m.size
        if comparable and float(np.mean((shape_m - self._shape_m) ** 2)) < _UNLIKE_M**2:
            return False
        self._stamp_ns, self._shape_m = stamp_ns, shape_m
        return True

    def whitening(self, observed: Observed) -> Array:
        """Of landmarks (m, 3, 3), as a look takes them."""
        found: Array = whitening(observed.covariances_m2, self._more_m2)
        return found

    def look(
        self, chains: HandChains, prior: PosePrior, seen: Observations, estimate: HandEstimate
    ) -> bool:
        """Learn from a message's landmarks and the pose found; whether the size is another now.

        chains and seen at the present size; prior: what is known of a pose before anything is seen.
        """
        slope, curvature = _parabola(chains, prior, seen, estimate)
        if not (math.isfinite(slope) and math.isfinite(curvature)):
            return False
        # The logarithm of a likelihood is half of what costs are.
        information = 0.5 * max(curvature, abs(slope) / _FARTHEST)
        here = math.log(self.factor)
        self._looks = min(self._looks + 1, _REMEMBERED)
        new = 1.0 / self._looks
        self._information += new * (information - self._information)
        self._pull += new * (information * here - 0.5 * slope - self._pull)
        found = self._likeliest()
        if abs(found - here) < _LEAST_CHANGE:
            return False
        self.factor = math.exp(found)
        return True

    def _likeliest(self) -> float:
        """The logarithm of the size, of looks and guess together."""
        if self._information == 0.0:
            return 0.0
        variance = _ALIKE**2 + 1.0 / (self._looks * self._information)
        found = self._pull / self._information / (1.0 + variance / GUESS**2)
        return min(max(found, -_MOST), _MOST)


@njit(cache=True)
def _parabola(
    chains: HandChains, prior: PosePrior, seen: Observations, estimate: HandEstimate
) -> tuple[float, float]:
    """Slope and curvature of the least cost by the logarithm of the size."""
    pose = Pose(estimate.rotation.copy(), estimate.position_m.copy(), estimate.angles_rad.copy())
    unused = np.empty((UNKNOWNS, UNKNOWNS))
    here, _ = fit(chains, seen, prior, pose, MAX_ITERATIONS, unused)
    costs = np.empty(2)
    for k in range(2):
        factor = math.exp((2 * k - 1) * _APART)
        at = Pose(pose.rotation.copy(), pose.position_m.copy(), pose.angles.copy())
        other = Observations(
            seen.joint,
            seen.digit,
            seen.depth,
            resized_offsets(seen, factor),
            seen.point_m,
            seen.whitening,
        )
        costs[k], _ = fit(resized(chains, factor), other, prior, at, MAX_ITERATIONS, unused)
    slope = (costs[1] - costs[0]) / (2.0 * _APART)
    return slope, (costs[0] - 2.0 * here + costs[1]) / _APART**2
