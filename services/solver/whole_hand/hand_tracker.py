"""One hand followed over time: the belief before a look, the fit, and when to doubt it.

The first pose needs the wrist and three tips in one message (start.py). From then on every look
starts from the belief. A look that fits badly, or sees a landmark that the last challenge did not,
or comes three seconds after it, is challenged: the pose that a start from nothing would give is
compared with the one that is being followed, and wins when it explains the markers clearly better
twice running; so a mirrored orientation cannot last. A gap in the stamps of more than a second,
stamps that run backwards, or a second with fewer than three markers forget the hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import TIPS, HandModel
from services.solver.maths.kinematics import hand_chains
from services.solver.whole_hand.fit import Marks, fit
from services.solver.whole_hand.initialise import begin
from services.solver.whole_hand.motion_prior import UNKNOWNS, Belief, predict, spd_inverse, unknown
from services.solver.whole_hand.point_check import Place, Seen
from services.solver.whole_hand.posture_prior import habit

# Markers that fix a pose well enough to keep it: three points are a plane with a direction.
ENOUGH = 3
# Longer gaps leave nothing to continue from: a hand is anywhere after a second.
_FORGET_S = 1.0
# Iterations of one look: 4 on average, 25 at worst on simulated hands; 30 are 0.2 ms.
_LOOK_ITERATIONS = 30
# A look whose squared distances exceed this per marker coordinate fits badly (expected: below 1).
_BAD = 16.0
# Looks between challenges, and while looks are bad: a start takes 5 ms, i.e. 0.05 and 1.2 ms a
# look.
_CHALLENGE_EVERY, _CHALLENGE_BAD = 90, 4
# How much cheaper (in squared standard deviations) a challenger must be, and how often running.
# Equal posture: differences below 1; a truth that a single look explains worse than another
# posture: up to 7 (720 simulated looks).
_CLEARLY, _TWICE = 12.0, 2


@dataclass(frozen=True)
class Look:
    """The hand after one message: wrist in the rig frame, angles (5, 4) rad within limits,
    covariance (26, 26), cost, iterations.
    """

    rotation: Array
    position_m: Array
    angles_rad: Array
    covariance: Array
    cost: float
    iterations: int


class HandTracker:
    """Follows one hand; pure: time comes in as stamps."""

    def __init__(self, model: HandModel, known: Mapping[str, Place]) -> None:
        self.chains = hand_chains(model)
        self.habit = habit(model)
        self._known = known
        self._nothing = unknown(self.habit)
        self._look: Look | None = None
        self._stamp_ns = 0
        self._enough_ns = 0
        self._until_challenge = _CHALLENGE_EVERY
        self._lost_challenges = 0
        self._challenged_with: frozenset[str] = frozenset()

    def look(self, stamp_ns: int, seen: Mapping[str, Seen]) -> Look | None:
        """The hand at stamp_ns given its usable landmarks (screen.usable).

        None while it has not been found.
        """
        seconds = (stamp_ns - self._stamp_ns) * 1e-9
        if self._look is not None and not (
            0.0 <= seconds <= _FORGET_S and (stamp_ns - self._enough_ns) * 1e-9 <= _FORGET_S
        ):
            self._look = None
        if len(seen) >= ENOUGH:
            self._enough_ns = stamp_ns
        marks = self._marks(seen)
        if self._look is None:
            if "wrist" not in seen or sum(name in seen for name in TIPS) < ENOUGH:
                return None
            self._look = self._from_nothing(marks)
        else:
            self._look = self._onwards(self._look, seconds, marks)
            if self._due(self._look, frozenset(seen)):
                self._look = self._challenged(self._look, marks)
        self._stamp_ns = stamp_ns
        return self._look

    def _marks(self, seen: Mapping[str, Seen]) -> Marks:
        where = [self._known[name] for name in seen]
        return Marks(
            joint=np.array([p.joint for p in where], dtype=np.int64),
            digit=np.array([p.digit for p in where], dtype=np.int64),
            depth=np.array([p.depth for p in where], dtype=np.int64),
            offset_m=np.array([p.offset_m for p in where], dtype=np.float64).reshape(-1, 3),
            point_m=np.array([s.point_m for s in seen.values()], dtype=np.float64).reshape(-1, 3),
            inverse_sigma=np.array(
                [s.inverse_sigma for s in seen.values()], dtype=np.float64
            ).reshape(-1, 3),
        )

    def _from_nothing(self, marks: Marks) -> Look:
        self._until_challenge, self._lost_challenges, self._challenged_with = (
            _CHALLENGE_BAD,
            0,
            frozenset(),
        )
        cost, R, t, q, information = begin(self.chains, self._nothing, marks)
        return Look(R, t, q, spd_inverse(information), cost, 0)

    def _onwards(self, last: Look, seconds: float, marks: Marks) -> Look:
        angles, information = predict(self.habit, last.angles_rad, last.covariance, seconds)
        belief = Belief(last.rotation, last.position_m, angles, information)
        R, t, found = last.rotation.copy(), last.position_m.copy(), np.empty((UNKNOWNS, UNKNOWNS))
        q = np.clip(angles, self.chains.limits_rad[:, :, 0], self.chains.limits_rad[:, :, 1])
        cost, used = fit(self.chains, marks, belief, R, t, q, _LOOK_ITERATIONS, found)
        return Look(R, t, q, spd_inverse(found), cost, used)

    def _due(self, look: Look, names: frozenset[str]) -> bool:
        """Whether this look is to be challenged."""
        self._until_challenge -= 1
        if look.cost > _BAD * 3 * max(len(names), 1) or not names <= self._challenged_with:
            self._until_challenge = min(self._until_challenge, _CHALLENGE_BAD)
        if self._until_challenge > 0 or len(names) <= ENOUGH:
            return False
        self._until_challenge, self._challenged_with = _CHALLENGE_EVERY, names
        return True

    def _challenged(self, look: Look, marks: Marks) -> Look:
        """The look, or the challenger when it has won often enough."""
        # Without the belief, both are judged by the same measure: markers and habit.
        R, t, q = look.rotation.copy(), look.position_m.copy(), look.angles_rad.copy()
        own, _ = fit(
            self.chains,
            marks,
            self._nothing,
            R,
            t,
            q,
            _LOOK_ITERATIONS,
            np.empty((UNKNOWNS, UNKNOWNS)),
        )
        cost, R, t, q, information = begin(self.chains, self._nothing, marks)
        self._lost_challenges = self._lost_challenges + 1 if cost < own - _CLEARLY else 0
        if self._lost_challenges:
            self._until_challenge = 1
        if self._lost_challenges < _TWICE:
            return look
        self._lost_challenges = 0
        return Look(R, t, q, spd_inverse(information), cost, look.iterations)
