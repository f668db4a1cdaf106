"""One hand followed over time: predict, fit, and compare with a restart when in doubt.

- The first pose needs the wrist and three tips in one message, all of them where somebody knows
  (initialise.py): from one camera's first look they may be anywhere along its rays.
- From then on every message is fitted from the motion prior.
- A restart is due when the fit is bad, when a landmark is seen that the last restart did not see,
  and about every three seconds. It initialises the hand as if nothing were known, once the pose is
  out (`challenge`), and counts from the next message on. Another pose that
  explains the landmarks about as well is followed as a rival (rival.py) until one of the two has
  won: so a mirrored orientation cannot last, and none is taken on the evidence of one message.
- What fits cost says how far the hand model is to be believed (model_misfit.py).
- Of a hand that nobody measured the size is learned, too, once a pose is out (hand_size.py).
- What is told follows what is believed no faster than a hand moves (glide.py).
- The hand is forgotten after a gap in the stamps of more than a second, when stamps run backwards,
  and after a second with fewer than three landmarks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rhot.hand import TIPS, HandModel
from services.solver.maths.chains import hand_chains, resized
from services.solver.maths.cholesky import spd_inverse
from services.solver.whole_hand.fit import MAX_ITERATIONS, fit
from services.solver.whole_hand.glide import Told
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.hand_size import HandSize
from services.solver.whole_hand.initialise import Hypothesis, initialise
from services.solver.whole_hand.landmarks import (
    Landmarks,
    Observation,
    Observations,
    Observed,
    observation_arrays,
    observations_of,
)
from services.solver.whole_hand.model_misfit import learned_misfit
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS, uninformed_prior
from services.solver.whole_hand.priors.posture_prior import posture_prior
from services.solver.whole_hand.residuals import Pose
from services.solver.whole_hand.rival import Rival, same_pose
from services.solver.whole_hand.update import KNOWN, Known, follow

# Landmarks that fix a pose well enough to keep it: three points are a plane with a direction.
MIN_LANDMARKS = 3
# Longer gaps leave nothing to continue from: a hand is anywhere after a second.
MAX_GAP_S = 1.0
# A landmark less sure than that, the RMS of its axes, begins no hand: a hand's fingers are as long.
# (Live rigs: the first message of one camera told 0.6 m, and the pose was 200 mm off.)
_PLACED_SIGMA_M = 0.1
# A fit whose squared distances exceed this per landmark coordinate is bad (expected: below 1).
BAD_COST_PER_COORDINATE = 16.0
# Updates between restarts, and while fits are bad: a restart takes 2 ms, i.e. 0.02 and 0.5 ms an
# update.
RESTART_INTERVAL, RESTART_INTERVAL_BAD = 90, 4
# Another pose is followed as a rival unless the odds against it exceed this (logarithm): a truth
# that a single message explains worse than another posture does so by up to 7 units of cost, 3.5 of
# this (720 simulated messages).
START_ODDS = -4.0


class HandTracker:
    """Follows one hand; pure: time comes in as stamps."""

    def __init__(
        self,
        model: HandModel,
        landmarks: Landmarks,
        restart_every: int = RESTART_INTERVAL,
        size: HandSize | None = None,
    ) -> None:
        """landmarks: those of the model (landmarks.hand_landmarks); restart_every: updates.

        size: where the model's is only a guess; what is learned of it goes into chains, landmarks.
        """
        self.chains = hand_chains(model)
        self._guessed, self._size = hand_chains(model), size
        posture = posture_prior(model)
        # As kernels are given it.
        self.packed = KNOWN.pack(Known(self.chains, posture))
        self._landmarks = landmarks
        self._uninformed = uninformed_prior(posture)
        self._estimate: HandEstimate | None = None
        # What was told last.
        self._told: Told | None = None
        self._stamp_ns = 0
        # When there last were enough landmarks.
        self._located_ns = 0
        self._restart_every = self._updates_to_restart = restart_every
        self._misfit_m2 = 0.0
        self._rival: Rival | None = None
        self._restart_landmarks: frozenset[str] = frozenset()
        # What the last estimate was fitted to: landmarks, and their whitening (m, 3, 3).
        self._fitted = Observed.of({})
        self.whitening = np.empty((0, 3, 3))
        # An estimate that is to be compared with a restart, and what it was fitted to.
        self._to_challenge: tuple[HandEstimate, Observations] | None = None
        # The same of a look at the size.
        self._to_look: tuple[HandEstimate, Observed] | None = None

    def track(self, stamp_ns: int, observed: Mapping[str, Observation]) -> HandEstimate | None:
        """The hand at stamp_ns given its usable landmarks (point_check.usable_points).

        None while it has not been found.
        """
        self.challenge()
        observed = Observed.of(observed)
        seconds = (stamp_ns - self._stamp_ns) * 1e-9
        if self._estimate is not None and self._is_lost(stamp_ns, seconds):
            self._estimate = None
            if self._size is not None:
                self._size.lost()
        if len(observed) >= MIN_LANDMARKS:
            self._located_ns = stamp_ns
        if self._estimate is None or self._told is None:
            placed = {name for name, seen in observed.items() if _is_placed(seen)}
            if "wrist" not in placed or len(placed.intersection(TIPS)) < MIN_LANDMARKS:
                return None
            self._estimate, self._told = self._begun(observed)
        else:
            self._estimate, self._told = self._continued(
                self._estimate, self._told, observed, seconds
            )
            alone = self._rival is None
            if alone and self._size is not None and self._size.is_due(stamp_ns, observed):
                self._to_look = self._estimate, observed
        self._stamp_ns = stamp_ns
        return self._told.estimate

    @property
    def fitted(self) -> Observations:
        """What the last estimate was fitted to."""
        places = self._landmarks.places(self._fitted.names)
        return observations_of(places, self._fitted.points_m, self.whitening)

    @property
    def misfit_m2(self) -> float:
        """How far landmarks lie from the model's, as learned (model_misfit.py); a variance."""
        return self._misfit_m2

    @property
    def challenge_due(self) -> bool:
        """Whether challenge() has something to do."""
        return self._to_challenge is not None or self._to_look is not None

    def challenge(self) -> None:
        """Compare the last pose with a restart, and with other sizes, where that is due.

        It takes 2 ms: after the pose is out; the next track() does it where nobody has.
        """
        self._learn_size()
        if self._to_challenge is not None:
            own, observations = self._to_challenge
            self._to_challenge = None
            # Without the motion prior, both are judged by the same measure: landmarks and habit.
            own_cost = self._cost_without_history(own, observations)
            found = initialise(self.chains, self._uninformed, observations)
            self._follow_rival(own, own_cost, found)

    def _learn_size(self) -> None:
        if self._size is None or self._to_look is None:
            return
        own, observed = self._to_look
        self._to_look = None
        places = self._landmarks.places(observed.names)
        seen = observations_of(places, observed.points_m, self._size.whitening(observed))
        if self._size.look(self.chains, self._uninformed, seen, own):
            new = resized(self._guessed, self._size.factor)
            # In place: whoever has them packed sees it.
            for name in ("base_m", "metacarpal_m", "lengths_m", "tool_m"):
                getattr(self.chains, name)[:] = getattr(new, name)
            self._landmarks.resize(self._size.factor)

    def _continued(
        self, last: HandEstimate, told: Told, observed: Observed, seconds: float
    ) -> tuple[HandEstimate, Told]:
        """What is believed with a message, and what is told: the same, unless it jumped.

        The pose is followed, and its rival, of which one may have won.
        """
        places = self._landmarks.packed(observed.names)
        given = self.packed, places, observed, self._misfit_m2
        taken = follow(*given, last, told.estimate, seconds)
        if self._rival is not None:
            other = follow(*given, self._rival.estimate, told.estimate, seconds)
            self._rival = self._rival.after(taken.estimate, other.estimate, seconds)
            if self._rival.has_won():
                taken, self._rival = other, None
            elif self._rival.is_over(taken.estimate):
                self._rival = None
        own, self.whitening, self._misfit_m2, quiet = taken
        self._fitted = observed
        self._challenge_if_due(own, observed)
        if quiet and self._rival is None:
            return own, Told(own, observed.names, observed.points_m)
        believed = own if self._rival is None else self._rival.told(own)
        limits_rad = self.chains.limits_rad
        return own, told.then(believed, observed.names, self.fitted, limits_rad, seconds)

    def _is_lost(self, stamp_ns: int, seconds: float) -> bool:
        """Whether stamps ran backwards, or nothing was known of the hand for too long."""
        unseen_s = (stamp_ns - self._located_ns) * 1e-9
        return not (0.0 <= seconds <= MAX_GAP_S and unseen_s <= MAX_GAP_S)

    def _begun(self, observed: Observed) -> tuple[HandEstimate, Told]:
        """The likeliest pose; the next that differs from it is followed as its rival."""
        self._fitted = observed
        self.whitening = observation_arrays(self._landmarks, observed).whitening
        self._updates_to_restart = RESTART_INTERVAL_BAD
        self._restart_landmarks = frozenset()
        best, *others = initialise(self.chains, self._uninformed, self.fitted)
        self._rival = None
        own = _estimate_of(best)
        self._follow_rival(own, best.cost, others)
        self._misfit_m2 = learned_misfit(0.0, self.whitening, own.cost, MAX_GAP_S)
        believed = own if self._rival is None else self._rival.told(own)
        return own, Told(believed, observed.names, observed.points_m)

    def _follow_rival(
        self, own: HandEstimate, own_cost: float, found: Sequence[Hypothesis]
    ) -> None:
        """Have the first other pose followed that explains a message about as well as the pose."""
        for hypothesis in found:
            odds, other = 0.5 * (own_cost - hypothesis.cost), _estimate_of(hypothesis)
            if odds > START_ODDS and not same_pose(own, other):
                if self._rival is None or not same_pose(self._rival.estimate, other):
                    self._rival = Rival(other, min(odds, -START_ODDS), 0.0)
                return

    def _challenge_if_due(self, estimate: HandEstimate, observed: Observed) -> None:
        """Have an estimate compared with a restart, where that is due."""
        self._updates_to_restart -= 1
        names = observed.names
        bad = estimate.cost > BAD_COST_PER_COORDINATE * 3 * max(len(names), 1)
        if bad or not self._restart_landmarks.issuperset(names):
            self._updates_to_restart = min(self._updates_to_restart, RESTART_INTERVAL_BAD)
        if self._updates_to_restart <= 0 and len(names) > MIN_LANDMARKS:
            self._updates_to_restart = self._restart_every
            self._restart_landmarks = frozenset(names)
            self._to_challenge = estimate, self.fitted

    def _cost_without_history(self, estimate: HandEstimate, observations: Observations) -> float:
        """The least cost near the estimate where the prior says nothing of the wrist."""
        pose = Pose(
            estimate.rotation.copy(), estimate.position_m.copy(), estimate.angles_rad.copy()
        )
        unused = np.empty((UNKNOWNS, UNKNOWNS))
        cost, _ = fit(self.chains, observations, self._uninformed, pose, MAX_ITERATIONS, unused)
        return cost


def _is_placed(seen: Observation) -> bool:
    """Whether a landmark's place is known well enough to begin a hand with."""
    return float(np.trace(seen.covariance_m2)) <= 3.0 * _PLACED_SIGMA_M**2


def _estimate_of(found: Hypothesis) -> HandEstimate:
    return HandEstimate(*found.pose, spd_inverse(found.information), found.cost, 0)
