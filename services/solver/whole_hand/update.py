"""A hand's pose from one message to the next: predict, fit, and how sure that is.

One compiled call: the arrays that a call from Python is given cost as much as some iterations.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.chains import HandChains
from services.solver.maths.cholesky import spd_inverse
from services.solver.whole_hand.fit import MAX_ITERATIONS, fit
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.motion_prior import UNKNOWNS, PosePrior, predict
from services.solver.whole_hand.posture_prior import PosturePrior
from services.solver.whole_hand.residuals import Pose


@njit(cache=True)
def update(
    chains: HandChains,
    posture: PosturePrior,
    observations: Observations,
    last: Pose,
    covariance: Array,
    seconds: float,
) -> tuple[Pose, Array, float, int]:
    """The pose some seconds after the last one, of covariance (26, 26), and its own covariance.

    Also what the fit costs, in squared standard deviations, and its iterations.
    """
    angles, information = predict(posture, last.angles, covariance, seconds)
    prior = PosePrior(last.rotation, last.position_m, angles, information)
    pose = Pose(last.rotation.copy(), last.position_m.copy(), angles.copy())
    for a in range(20):
        limit = chains.limits_rad[a // 4, a % 4]
        pose.angles[a // 4, a % 4] = min(max(angles[a // 4, a % 4], limit[0]), limit[1])
    found = np.empty((UNKNOWNS, UNKNOWNS))
    cost, used = fit(chains, observations, prior, pose, MAX_ITERATIONS, found)
    return pose, spd_inverse(found), cost, used
