"""The prior on a hand's pose from its past: a Gaussian, blurred by the time that passes.

Each measurement sharpens it. In between, the wrist drifts as a random walk and the angles return to
the habitual posture (an Ornstein-Uhlenbeck process whose stationary state is the PosturePrior), so
that the soft constraints are counted once, not once a frame, and a finger that is hidden relaxes
with honest uncertainty. What the fingers share is forgotten sooner than what each does alone: along
it the landmarks say least (the palm's pitch against all knuckles), and there noise shifts the
estimate always the same way, towards bent fingers, whose tips need less turning to follow it; the
shift adds up over the time that is remembered. A long gap simply blurs everything; the caller
starts anew then.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.cholesky import spd_inverse
from services.solver.whole_hand.posture_prior import PosturePrior

# Unknowns of a hand's pose: rotation (0..2), position (3..5) and 20 angles.
UNKNOWNS = 26
# Process noise of the wrist's random walk: 1 rad and 1 m in a second (root mean square), 10 deg and
# 0.18 m in a 30 Hz frame. Simulated hands that twist by 45 deg at 2.5 Hz: orientation error 5.6 deg
# at 1.5 rad, 6.9 at 0.7; quiet hands gain 0.1 deg from 1.5 to 0.5 rad.
_ROTATION_NOISE_RAD_SQRT_S, _POSITION_NOISE_M_SQRT_S = 1.0, 1.0
# Time constant in which a finger forgets its own part of the posture, and the hand what the fingers
# share. Flexion error of hands with 1 mm of noise (six motions of the simulator; fists and random
# motions with a turning wrist): shared part 0.6 s 5.8 and 3.8 deg, 0.2 s 4.9 and 3.9, 0.1 s 4.4 and
# 4.1. No memory at all costs those with a painted knuckle 15 %.
_RELAXATION_S, _SYNERGY_RELAXATION_S = 0.6, 0.2


class PosePrior(NamedTuple):
    """The pose expected before measuring, and how surely.

    An information matrix over rotation, position, angles (rad, m).
    """

    rotation: Array  # (3, 3) wrist in the rig frame
    position_m: Array  # (3,)
    angles: Array  # (5, 4)
    information: Array  # (26, 26); rotation is a rotation vector about the rig's axes


def uninformed_prior(posture: PosturePrior) -> PosePrior:
    """The prior before the first measurement: nothing of the wrist, the habit of the angles."""
    information = np.zeros((UNKNOWNS, UNKNOWNS))
    information[6:, 6:] = posture.information
    return PosePrior(np.eye(3), np.zeros(3), posture.mean.reshape(5, 4).copy(), information)


@njit(cache=True)
def predict(
    posture: PosturePrior, angles: Array, covariance: Array, seconds: float
) -> tuple[Array, Array]:
    """Time update: angles (5, 4) and the information (26, 26) some seconds later.

    From angles and *covariance* (26, 26). The covariance becomes K P K' + H - K H K' with the
    habit's H; the projection that K is made of commutes with H.
    """
    keep = math.exp(-seconds / _RELAXATION_S)
    keep_shared = math.exp(-seconds / _SYNERGY_RELAXATION_S)
    off = (angles.ravel() - posture.mean).reshape(20, 1)
    expected = (posture.mean + _relax(posture, off, keep, keep_shared)[:, 0]).reshape(5, 4)
    P = covariance.copy()
    P[6:, :6] = _relax(posture, covariance[6:, :6], keep, keep_shared)
    P[:6, 6:] = P[6:, :6].T
    relaxed = _relax(posture, covariance[6:, 6:] - posture.covariance, keep, keep_shared)
    P[6:, 6:] = posture.covariance + _relax(posture, relaxed.T.copy(), keep, keep_shared)
    for a in range(3):
        P[a, a] += _ROTATION_NOISE_RAD_SQRT_S**2 * seconds
        P[3 + a, 3 + a] += _POSITION_NOISE_M_SQRT_S**2 * seconds
    return expected, spd_inverse(P)


@njit(cache=True)
def _relax(posture: PosturePrior, values: Array, keep: float, keep_shared: float) -> Array:
    """K @ values for K = keep * identity + (keep_shared - keep) * synergies @ projection.

    (20, n) -> (20, n). In loops: sums of rows would each make a new one.
    """
    rows, columns = values.shape
    out = np.empty((rows, columns))
    for a in range(rows):
        for n in range(columns):
            out[a, n] = keep * values[a, n]
    share = np.empty(columns)
    for m in range(2):
        share[:] = 0.0
        for a in range(rows):
            for n in range(columns):
                share[n] += posture.projection[m, a] * values[a, n]
        for a in range(rows):
            if posture.synergies[a, m] != 0.0:
                weight = (keep_shared - keep) * posture.synergies[a, m]
                for n in range(columns):
                    out[a, n] += weight * share[n]
    return out
