"""How sure a pose is of which the hand's model is not: consider states.

The fit takes bones and paint for known. They are not: bones of people of one size differ by a
tenth, a dab sits some millimetres beside where it should. Such an error is constant, so it does not
average out over frames, and the fit's own covariance P, which knows noise and habit, says nothing
of it. Here the constant errors b are consider states (Schmidt 1966; Jazwinski 1970, section 8.4):
they are not estimated, but their effect S = d(pose error)/d(b) is carried along with every update,

    S = S_before - P H' R^-1 (H S_before + J),

H and J the derivatives of the landmarks by pose and by b, R the landmarks' covariance. S B S' is
what they add to the pose's covariance, B the covariance of b. Limits of joints are not considered.
R is the fit's own, with the misfit that it learned: with a smaller one P H' R^-1 H exceeds what P
allows, and S grows without end where it should die away. Huber's weights and a rival's share of P
do the same for some messages, so the gain is held to that bound (`_consistent_share`).
Two cures go with that: landmarks are told to the fit no more precisely than the model is
(`landmark_m2`), and a hand that was measured has small errors, one that is known exactly none.

B is that of all people. One person's hand may be nearly the tables', or another hand altogether;
how far its landmarks miss the model once it is fitted tells which. So variances are scaled by what
fits of the last seconds left of them, squared, over what is usual (`Spread.residual_m`): a
posteriori, as geodesists call it. But for what a wrong size does, which leaves no residual.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import TIPS, HandModel
from rhot.kernels.packed import Packed
from services.solver.error_effect import EFFECT, PAINT, Effect, Errors, variances
from services.solver.maths.chains import HandChains
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.hand_size import GUESS
from services.solver.whole_hand.hand_tracker import MAX_GAP_S
from services.solver.whole_hand.landmarks import MAX_LISTS, Observations
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS

# Time in which what an old error did to the angles is forgotten, between the motion prior's two.
_FORGET_S = 0.4


class Spread(NamedTuple):
    """Standard deviations of what a model says."""

    size: float  # of the whole hand, a share
    bone: float  # of each bone, a share
    root_m: float  # of each chain's root along each axis
    tip_paint_m: tuple[float, float, float]  # of a tip's paint in its joint's frame
    dab_m: tuple[float, float, float]  # of a dab
    landmark_m: float  # of a landmark along each axis, as the fit is told
    # How far landmarks miss the fitted model where variances are right as they are, per degree of
    # freedom that the fit has not; 0: not known, variances stay.
    residual_m: float = 0.0


# Bones within a tenth, paint dipped 8 to 20 mm deep, dabs within 5 mm, all evenly. Fourteen
# rendered captures of such hands: with landmarks at 0, 2, 4 and 8 mm fingers were off by 14.0,
# 11.1, 10.3 and 9.4 deg RMS, orientation by 8.5, 7.7, 7.3 and 7.0; beyond, hands of the tables'
# proportions lose more than others gain. Residuals: tuning captures, ten of them of the tables' own
# hand, two of others within a tenth, two of recorded hands that differ by more. Squared errors over
# variances of orientation were .01-.14, .14-.20 and 1.3-4.3 without, .01-.4, .20-.25 and 1.0-1.4
# scaled so; of points .3-.9, .4-.5 and 1.4-2.3 before, .4-1.2, .6 and 1.2-2.6.
_TABLES = Spread(GUESS, 0.06, 3e-3, (5e-4, 5e-4, 2e-3), (3e-3, 1e-3, 3e-3), 5e-3, 1.6e-3)
# What `rhot calibrate hand` leaves: knuckles within 3 mm, and paint that is put on anew.
_MEASURED = Spread(0.0, 0.02, 1e-3, (5e-4, 5e-4, 1e-3), (1e-3, 5e-4, 1e-3), 1e-3)
_EXACT = Spread(0.0, 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)


def landmark_m2(model: HandModel) -> float:
    """What the fit is told of each landmark's place on the hand, a variance along each axis."""
    return _spread(model).landmark_m ** 2


def _spread(model: HandModel) -> Spread:
    return {"tables": _TABLES, "measured": _MEASURED}.get(model.origin, _EXACT)


class ErrorsAt(NamedTuple):
    """Errors whose effect is packed."""

    effect: Packed
    landmark_m2: tuple[float, float]
    keep: float

    def unpacked(self) -> Errors:
        """For kernels that are given arrays."""
        return Errors(self.effect.parts, self.landmark_m2, self.keep)


class ModelError:
    """The errors of one hand's model, and what they have done to its pose."""

    def __init__(self, model: HandModel, chains: HandChains) -> None:
        spread = _spread(model)
        self._chains, self._spread = chains, spread
        # Added to each landmark's variance along each axis: it is known no better than the model
        # knows where it sits.
        self.landmark_m2 = landmark_m2(model)
        # The first column of each landmark's paint, in the order in which they were first seen:
        # most hands have paint for many more than are painted.
        self._column: dict[str, int] = {}
        # By the landmarks of a message: what errors did, and where their paint is in it.
        self._effects: dict[tuple[str, ...], Packed] = {}
        self._sigmas = np.array([spread.size, *[spread.bone] * 15, *[spread.root_m] * 15])
        self._S = np.zeros((UNKNOWNS, PAINT))
        self._misfit = np.ones(1)
        self._stamp_ns = 0

    def pose_variances(
        self,
        stamp_ns: int,
        estimate: HandEstimate,
        names: tuple[str, ...],
        observations: Observations,
        misfit_m2: float = 0.0,
    ) -> Array:
        """The variances (26,) of an estimate's rotation, position and angles (rad^2, m^2).

        names and observations: the landmarks that it was fitted to, as the fit was told; misfit_m2
        as in errors().
        """
        errors = self.errors(stamp_ns, names, misfit_m2).unpacked()
        found: Array = variances(self._chains, observations, estimate, errors)
        return found

    def errors(self, stamp_ns: int, names: tuple[str, ...], misfit_m2: float) -> ErrorsAt:
        """What `variances` is to take on to a message of landmarks of these names.

        misfit_m2 is in the landmarks' variances too, as the fit was told (model_misfit.py).
        """
        seconds = (stamp_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = stamp_ns
        is_gap = not 0.0 <= seconds <= MAX_GAP_S
        effect = self._effects.get(names)
        if effect is None:
            columns = np.array([self._column_of(name) for name in names], dtype=np.int64)
            effect = EFFECT.pack(Effect(self._S, self._sigmas, self._misfit, columns))
            # Names come from the network, in any order: the memory for them is bounded.
            if len(self._effects) < MAX_LISTS:
                self._effects[names] = effect
        keep = 0.0 if is_gap else math.exp(-seconds / _FORGET_S)
        usual_m2 = self._spread.residual_m**2
        return ErrorsAt(effect, (usual_m2, self.landmark_m2 + misfit_m2), keep)

    def _column_of(self, name: str) -> int:
        """The first column of a landmark's paint, which is new where it was never seen."""
        known = self._column.get(name)
        if known is None:
            known = self._column[name] = len(self._sigmas)
            paint_m = self._spread.tip_paint_m if name in TIPS else self._spread.dab_m
            self._sigmas = np.append(self._sigmas, paint_m)
            self._S = np.hstack([self._S, np.zeros((UNKNOWNS, 3))])
            # They have the old arrays.
            self._effects.clear()
        return known
