"""A resting hand's landmarks: the estimate of each track mixed with its place in the body.

Compiled; nothing here raises.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.kalman.rest.rest_detection import FADE_S, FRESH_S, REACH_S, REST_THRESHOLD
from services.fusion.kalman.rest.rigid_body import RestState, place_in_body


@njit(cache=True, error_model="numpy")
def mix_rest(rest: RestState, time_s: float, found: Bools, means: Array, covs: Array) -> None:
    """Mix the tracks' estimates at an instant (L, 3), (L, 3, 3) with the bodies', in place.

    Those of landmarks found (L,) change whose rest has lasted.
    """
    place = np.empty(3)
    J = np.empty((3, 6))
    H = np.empty((3, 18))
    for landmark in range(rest.hand.shape[0]):
        hand = rest.hand[landmark]
        dt_s = time_s - rest.time_s[hand]
        rests = rest.sustained[landmark] > REST_THRESHOLD
        if not (found[landmark] and rests and abs(dt_s) <= REACH_S):
            continue
        share = _share(rest, landmark, time_s)
        # The place's covariance, by its Jacobian H (3, 18) of the body's motion.
        place_in_body(rest, landmark, dt_s, place, J)
        H[:, :6] = J
        H[:, 6:12] = dt_s * J
        H[:, 12:] = 0.5 * dt_s * dt_s * J
        cov = H @ rest.cov[hand] @ H.T + rest.anchor_cov[landmark]  # (3, 3)
        # Mean and covariance of a mixture of two Gaussians.
        for i in range(3):
            for j in range(3):
                apart = (place[i] - means[landmark, i]) * (place[j] - means[landmark, j])
                covs[landmark, i, j] += share * (
                    0.5 * (cov[i, j] + cov[j, i]) - covs[landmark, i, j] + (1.0 - share) * apart
                )
        for i in range(3):
            means[landmark, i] += share * (place[i] - means[landmark, i])


@njit(cache=True, error_model="numpy")
def _share(rest: RestState, landmark: int, time_s: float) -> float:
    """The body's weight in the mixture, 0 to 1.

    0 at REST_THRESHOLD: a body that is far off must not even add to the spread of markers that move
    by themselves. It fades while nobody sees the marker.
    """
    unseen_s = max(time_s - rest.observed_s[landmark] - FRESH_S, 0.0)
    return (
        (rest.sustained[landmark] - REST_THRESHOLD)
        / (1.0 - REST_THRESHOLD)
        * math.exp(-unseen_s / FADE_S)
    )
