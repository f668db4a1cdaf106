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
from services.solver.maths.kinematics import FUSED
from services.solver.whole_hand.priors.posture_prior import PosturePrior

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


@njit(cache=True, fastmath=FUSED)
def predict(
    posture: PosturePrior, angles: Array, covariance: Array, seconds: float
) -> tuple[Array, Array]:
    """Time update: angles (5, 4) and the information (26, 26) some seconds later.

    From angles and *covariance* (26, 26). The covariance becomes K P K' + H - K H K' with the
    habit's H; the projection that K is made of commutes with H. K of the angles is keep * identity
    + synergies @ D, with a D of two rows: all of K C K', C = P - H, is in W = keep D C + 1/2 D C D'
    synergies'.
    """
    keep = math.exp(-seconds / _RELAXATION_S)
    D = (math.exp(-seconds / _SYNERGY_RELAXATION_S) - keep) * posture.projection
    S = posture.synergies
    # Of P, its lower triangle; C in the place of the angles.
    P, moved = covariance.copy(), np.zeros((2, UNKNOWNS))
    for a in range(20):
        for b in range(20):
            P[6 + a, 6 + b] -= posture.covariance[a, b]
    for m in range(2):
        for a in range(20):
            for n in range(UNKNOWNS):
                moved[m, n] += D[m, a] * P[6 + a, n]
    W, off = keep * moved, np.zeros(2)
    for m in range(2):
        for n in range(2):
            both = 0.0
            for a in range(20):
                both += moved[m, 6 + a] * D[n, a]
            for a in range(20):
                W[m, 6 + a] += 0.5 * both * S[a, n]
        for a in range(20):
            off[m] += D[m, a] * (angles[a // 4, a % 4] - posture.mean[a])
    expected = np.empty((5, 4))
    for a in range(20):
        away = angles[a // 4, a % 4] - posture.mean[a]
        away = keep * away + S[a, 0] * off[0] + S[a, 1] * off[1]
        expected[a // 4, a % 4] = posture.mean[a] + away
        for n in range(6):
            P[6 + a, n] = keep * P[6 + a, n] + S[a, 0] * moved[0, n] + S[a, 1] * moved[1, n]
        for b in range(a + 1):
            shared = S[a, 0] * W[0, 6 + b] + S[a, 1] * W[1, 6 + b]
            shared += W[0, 6 + a] * S[b, 0] + W[1, 6 + a] * S[b, 1]
            P[6 + a, 6 + b] = posture.covariance[a, b] + keep**2 * P[6 + a, 6 + b] + shared
    for a in range(3):
        P[a, a] += _ROTATION_NOISE_RAD_SQRT_S**2 * seconds
        P[3 + a, 3 + a] += _POSITION_NOISE_M_SQRT_S**2 * seconds
    return expected, spd_inverse(P)
