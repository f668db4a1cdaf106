"""A hand's pose from one message to the next: predict, fit, and how sure that is.

One compiled call: the arrays that a call from Python is given cost as much as some iterations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.chains import HandChains
from services.solver.maths.cholesky import spd_inverse
from services.solver.whole_hand.fit import MAX_ITERATIONS, fit
from services.solver.whole_hand.fixed_numbers import chains_of, posture_of
from services.solver.whole_hand.glide import is_quiet
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.landmarks import Observations, Places, whitening
from services.solver.whole_hand.model_misfit import learned_misfit
from services.solver.whole_hand.motion_prior import UNKNOWNS, PosePrior, predict
from services.solver.whole_hand.posture_prior import PosturePrior
from services.solver.whole_hand.residuals import Pose


class Followed(NamedTuple):
    """What a message made of a hand that nothing rivals."""

    estimate: HandEstimate
    whitening: Array  # (m, 3, 3) of the landmarks, as in Observations
    misfit_m2: float  # as learned from it
    quiet: bool  # whether it may be told as it is (glide.py)


@njit(cache=True)
def follow(
    fixed: Array,
    places: Places,
    seen: tuple[Array, Array],
    misfit_m2: float,
    last: tuple[HandEstimate, HandEstimate],
    seconds: float,
) -> Followed:
    """A message of landmarks that sit at places, some seconds after the last estimate.

    fixed: as fixed_numbers.py has them. seen: points (m, 3) and covariances (m, 3, 3) in the rig
    frame. last: what was believed and what was told.
    """
    observations = Observations(
        places.joint,
        places.digit,
        places.depth,
        places.offset_m,
        seen[0],
        whitening(seen[1], misfit_m2),
    )
    own = update(chains_of(fixed), posture_of(fixed), observations, last[0], seconds)
    learned_m2 = learned_misfit(misfit_m2, observations.whitening, own.cost, seconds)
    return Followed(own, observations.whitening, learned_m2, is_quiet(last[1], own, seconds))


@njit(cache=True)
def update(
    chains: HandChains,
    posture: PosturePrior,
    observations: Observations,
    last: HandEstimate,
    seconds: float,
) -> HandEstimate:
    """The hand some seconds after the last estimate of it: predicted, then fitted."""
    angles, information = predict(posture, last.angles_rad, last.covariance, seconds)
    prior = PosePrior(last.rotation, last.position_m, angles, information)
    pose = Pose(last.rotation.copy(), last.position_m.copy(), angles.copy())
    for a in range(20):
        limit = chains.limits_rad[a // 4, a % 4]
        pose.angles[a // 4, a % 4] = min(max(angles[a // 4, a % 4], limit[0]), limit[1])
    found = np.empty((UNKNOWNS, UNKNOWNS))
    cost, used = fit(chains, observations, prior, pose, MAX_ITERATIONS, found)
    return HandEstimate(pose.rotation, pose.position_m, pose.angles, spd_inverse(found), cost, used)
