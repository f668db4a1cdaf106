"""What is known of a hand's pose before the next look: a Gaussian that every look sharpens and time blurs.

Between looks the wrist drifts as a random walk and the angles return to the habitual posture (an Ornstein-Uhlenbeck process whose
resting state is `Habit`), so that the soft constraints are counted once, not once a frame, and a finger that is hidden relaxes
with honest uncertainty. The covariance keeps what the markers leave open (three directions of 21) small once motion has shown it.
A long gap simply blurs everything; the caller starts anew then.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.transforms import Array
from services.solver.constraints import Habit

UNKNOWNS = 26
# Random walk of the wrist: 1.5 rad and 1 m in a second (root mean square), 16 deg and 0.18 m in a 30 Hz frame: faster than any
# deliberate movement of a hand, so that the walk never holds it back.
_TURN_RAD_SQRT_S, _SHIFT_M_SQRT_S = 1.5, 1.0
# Time in which a finger forgets its posture. Simulated fists and random motions: flexion error 3.8 / 5.3 deg at 0.6 s,
# 5.2 / 6.4 deg without memory.
_FORGET_S = 0.6


class Belief(NamedTuple):
    """The pose expected before looking, and how surely: an information matrix over rotation, position, angles (rad, m)."""

    rotation: Array  # (3, 3) wrist in the rig frame
    position_m: Array  # (3,)
    angles: Array  # (5, 4)
    information: Array  # (26, 26); rotation is a turn about the rig's axes


def unknown(habit: Habit) -> Belief:
    """The belief before the first look: nothing of the wrist, the habit of the angles."""
    information = np.zeros((UNKNOWNS, UNKNOWNS))
    information[6:, 6:] = habit.information
    return Belief(np.eye(3), np.zeros(3), habit.mean.reshape(5, 4).copy(), information)


@njit(cache=True)
def spd_inverse(A: Array) -> Array:
    """Inverse of a symmetric positive definite matrix (n, n) by Cholesky; what is not definite is treated as barely so."""
    n = A.shape[0]
    L = np.zeros((n, n))
    for a in range(n):
        for b in range(a + 1):
            total = A[a, b]
            for k in range(b):
                total -= L[a, k] * L[b, k]
            if a == b:
                L[a, a] = math.sqrt(total) if total > 1e-12 else 1e-6
            else:
                L[a, b] = total / L[b, b]
    M = np.zeros((n, n))
    for a in range(n):
        M[a, a] = 1.0 / L[a, a]
        for b in range(a):
            total = 0.0
            for k in range(b, a):
                total -= L[a, k] * M[k, b]
            M[a, b] = total / L[a, a]
    out = np.empty((n, n))
    for a in range(n):
        for b in range(a + 1):
            total = 0.0
            for k in range(a, n):
                total += M[k, a] * M[k, b]
            out[a, b] = out[b, a] = total
    return out


@njit(cache=True)
def predict(habit: Habit, angles: Array, covariance: Array, seconds: float) -> tuple[Array, Array]:
    """Angles (5, 4) and covariance (26, 26) after some seconds without looking; returns the angles and the *information*."""
    keep = math.exp(-seconds / _FORGET_S)
    expected = np.empty((5, 4))
    P = covariance.copy()
    for a in range(20):
        expected[a // 4, a % 4] = habit.mean[a] + keep * (angles[a // 4, a % 4] - habit.mean[a])
        for b in range(6):
            P[6 + a, b] *= keep
            P[b, 6 + a] *= keep
        for b in range(20):
            P[6 + a, 6 + b] = keep * keep * P[6 + a, 6 + b] + (1.0 - keep * keep) * habit.covariance[a, b]
    for a in range(3):
        P[a, a] += _TURN_RAD_SQRT_S**2 * seconds
        P[3 + a, 3 + a] += _SHIFT_M_SQRT_S**2 * seconds
    return expected, spd_inverse(P)
