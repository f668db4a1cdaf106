"""One hand followed over time: predict, fit, and compare with a restart when in doubt.

- The first pose needs the wrist and three tips in one message (initialise.py).
- From then on every message is fitted from the motion prior.
- A restart is due when the fit is bad, when a landmark is seen that the last restart did not see,
  and every three seconds. It initialises the hand as if nothing were known, and its pose is taken
  when it explains the landmarks clearly better twice running: so a mirrored orientation cannot
  last.
- The hand is forgotten after a gap in the stamps of more than a second, when stamps run backwards,
  and after a second with fewer than three landmarks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import TIPS, HandModel
from services.solver.maths.chains import hand_chains
from services.solver.maths.cholesky import spd_inverse
from services.solver.whole_hand.fit import fit
from services.solver.whole_hand.initialise import initialise
from services.solver.whole_hand.landmarks import (
    Landmark,
    Observation,
    Observations,
    observation_arrays,
)
from services.solver.whole_hand.motion_prior import (
    UNKNOWNS,
    PosePrior,
    predict,
    uninformed_prior,
)
from services.solver.whole_hand.posture_prior import posture_prior
from services.solver.whole_hand.residuals import Pose

# Landmarks that fix a pose well enough to keep it: three points are a plane with a direction.
MIN_LANDMARKS = 3
# Longer gaps leave nothing to continue from: a hand is anywhere after a second.
MAX_GAP_S = 1.0
# Iterations of one update: 4 on average, 25 at worst on simulated hands; 30 are 0.2 ms.
MAX_ITERATIONS = 30
# A fit whose squared distances exceed this per landmark coordinate is bad (expected: below 1).
BAD_COST_PER_COORDINATE = 16.0
# Updates between restarts, and while fits are bad: a restart takes 5 ms, i.e. 0.05 and 1.2 ms an
# update.
RESTART_INTERVAL, RESTART_INTERVAL_BAD = 90, 4
# How much cheaper (in squared standard deviations) a restart must be, and how often running. Equal
# posture: differences below 1; a truth that a single message explains worse than another posture:
# up to 7 (720 simulated messages).
MIN_COST_GAIN, WINS_NEEDED = 12.0, 2


@dataclass(frozen=True)
class HandEstimate:
    """The hand after one message."""

    rotation: Array  # (3, 3) wrist in the rig frame
    position_m: Array  # (3,)
    angles_rad: Array  # (5, 4) within limits
    covariance: Array  # (26, 26) of rotation, position and angles (rad, m)
    cost: float  # squared standard deviations
    iterations: int


class HandTracker:
    """Follows one hand; pure: time comes in as stamps."""

    def __init__(self, model: HandModel, landmarks: Mapping[str, Landmark]) -> None:
        """landmarks: those of the model (landmarks.hand_landmarks)."""
        self.chains = hand_chains(model)
        self._posture = posture_prior(model)
        self._landmarks = landmarks
        self._uninformed = uninformed_prior(self._posture)
        self._estimate: HandEstimate | None = None
        self._stamp_ns = 0
        # When there last were enough landmarks.
        self._located_ns = 0
        self._updates_to_restart = RESTART_INTERVAL
        self._restart_wins = 0
        self._restart_landmarks: frozenset[str] = frozenset()

    def track(self, stamp_ns: int, observed: Mapping[str, Observation]) -> HandEstimate | None:
        """The hand at stamp_ns given its usable landmarks (point_check.usable_points).

        None while it has not been found.
        """
        seconds = (stamp_ns - self._stamp_ns) * 1e-9
        if self._estimate is not None and self._is_lost(stamp_ns, seconds):
            self._estimate = None
        if len(observed) >= MIN_LANDMARKS:
            self._located_ns = stamp_ns
        observations = observation_arrays(self._landmarks, observed)
        if self._estimate is None:
            if "wrist" not in observed or sum(name in observed for name in TIPS) < MIN_LANDMARKS:
                return None
            self._estimate = self._initialise(observations)
        else:
            self._estimate = self._update(self._estimate, seconds, observations)
            if self._restart_due(self._estimate, frozenset(observed)):
                self._estimate = self._compare_with_restart(self._estimate, observations)
        self._stamp_ns = stamp_ns
        return self._estimate

    def _is_lost(self, stamp_ns: int, seconds: float) -> bool:
        """Whether stamps ran backwards, or nothing was known of the hand for too long."""
        unseen_s = (stamp_ns - self._located_ns) * 1e-9
        return not (0.0 <= seconds <= MAX_GAP_S and unseen_s <= MAX_GAP_S)

    def _initialise(self, observations: Observations) -> HandEstimate:
        self._updates_to_restart = RESTART_INTERVAL_BAD
        self._restart_wins = 0
        self._restart_landmarks = frozenset()
        cost, pose, information = initialise(self.chains, self._uninformed, observations)
        return HandEstimate(*pose, spd_inverse(information), cost, 0)

    def _update(
        self, last: HandEstimate, seconds: float, observations: Observations
    ) -> HandEstimate:
        """Predict from the last estimate and fit the observations."""
        angles, information = predict(self._posture, last.angles_rad, last.covariance, seconds)
        prior = PosePrior(last.rotation, last.position_m, angles, information)
        limits = self.chains.limits_rad
        start = np.clip(angles, limits[:, :, 0], limits[:, :, 1])
        pose = Pose(last.rotation.copy(), last.position_m.copy(), start)
        found = np.empty((UNKNOWNS, UNKNOWNS))
        cost, used = fit(self.chains, observations, prior, pose, MAX_ITERATIONS, found)
        return HandEstimate(*pose, spd_inverse(found), cost, used)

    def _restart_due(self, estimate: HandEstimate, names: frozenset[str]) -> bool:
        """Whether this estimate is to be compared with a restart."""
        self._updates_to_restart -= 1
        bad = estimate.cost > BAD_COST_PER_COORDINATE * 3 * max(len(names), 1)
        if bad or not names <= self._restart_landmarks:
            self._updates_to_restart = min(self._updates_to_restart, RESTART_INTERVAL_BAD)
        if self._updates_to_restart > 0 or len(names) <= MIN_LANDMARKS:
            return False
        self._updates_to_restart, self._restart_landmarks = RESTART_INTERVAL, names
        return True

    def _compare_with_restart(
        self, estimate: HandEstimate, observations: Observations
    ) -> HandEstimate:
        """The estimate, or that of a restart when it has won often enough."""
        # Without the motion prior, both are judged by the same measure: landmarks and habit.
        own_cost = self._cost_without_history(estimate, observations)
        cost, pose, information = initialise(self.chains, self._uninformed, observations)
        won = cost < own_cost - MIN_COST_GAIN
        self._restart_wins = self._restart_wins + 1 if won else 0
        if self._restart_wins:
            self._updates_to_restart = 1
        if self._restart_wins < WINS_NEEDED:
            return estimate
        self._restart_wins = 0
        return HandEstimate(*pose, spd_inverse(information), cost, estimate.iterations)

    def _cost_without_history(self, estimate: HandEstimate, observations: Observations) -> float:
        """The least cost near the estimate where the prior says nothing of the wrist."""
        pose = Pose(
            estimate.rotation.copy(), estimate.position_m.copy(), estimate.angles_rad.copy()
        )
        unused = np.empty((UNKNOWNS, UNKNOWNS))
        cost, _ = fit(self.chains, observations, self._uninformed, pose, MAX_ITERATIONS, unused)
        return cost
