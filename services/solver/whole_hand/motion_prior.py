"""What is known of a hand's pose before the next look: a Gaussian that every look sharpens and time
blurs.

Between looks the wrist drifts as a random walk and the angles return to the habitual posture (an
Ornstein-Uhlenbeck process whose resting state is `Habit`), so that the soft constraints are counted
once, not once a frame, and a finger that is hidden relaxes with honest uncertainty. What the
fingers share is forgotten sooner than what each does alone: along it the markers say least (the
palm's pitch against all knuckles), and there noise shifts the estimate always the same way, towards
bent fingers, whose tips need less turning to follow it; the shift adds up over the time that is
remembered. A long gap simply blurs everything; the caller starts anew then.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.whole_hand.posture_prior import Habit

UNKNOWNS = 26
# Random walk of the wrist: 1 rad and 1 m in a second (root mean square), 10 deg and 0.18 m in a 30
# Hz frame. Simulated hands that twist by 45 deg at 2.5 Hz: orientation error 5.6 deg at 1.5 rad,
# 6.9 at 0.7; quiet hands gain 0.1 deg from 1.5 to 0.5 rad.
_TURN_RAD_SQRT_S, _SHIFT_M_SQRT_S = 1.0, 1.0
# Time in which a finger forgets its own part of the posture, and the hand what the fingers share.
# Flexion error of hands with 1 mm of noise (six motions of the simulator; fists and random motions
# with a turning wrist): shared part 0.6 s 5.8 and 3.8 deg, 0.2 s 4.9 and 3.9, 0.1 s 4.4 and 4.1. No
# memory at all costs those with a painted knuckle 15 %.
_FORGET_S, _FORGET_SHARED_S = 0.6, 0.2


class Belief(NamedTuple):
    """The pose expected before looking, and how surely: an information matrix over rotation,
    position, angles (rad, m).
    """

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
    """Inverse of a symmetric positive definite matrix (n, n) by Cholesky.

    What is not definite is treated as barely so.
    """
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
def _faded(habit: Habit, values: Array, keep: float, keep_shared: float) -> Array:
    """K @ values for K = keep * identity + (keep_shared - keep) * together @ shares.

    (20, n) -> (20, n).
    """
    out = keep * values
    for m in range(2):
        share = np.zeros(values.shape[1])
        for a in range(20):
            share += habit.shares[m, a] * values[a]
        for a in range(20):
            if habit.together[a, m] != 0.0:
                out[a] += (keep_shared - keep) * habit.together[a, m] * share
    return out


@njit(cache=True)
def predict(habit: Habit, angles: Array, covariance: Array, seconds: float) -> tuple[Array, Array]:
    """Angles (5, 4) and covariance (26, 26) after some seconds without looking; returns the angles
    and the *information*.

    The covariance becomes K P K' + H - K H K' with the habit's H; the projection that K is made of
    commutes with H.
    """
    keep, keep_shared = math.exp(-seconds / _FORGET_S), math.exp(-seconds / _FORGET_SHARED_S)
    off = (angles.ravel() - habit.mean).reshape(20, 1)
    expected = (habit.mean + _faded(habit, off, keep, keep_shared)[:, 0]).reshape(5, 4)
    P = covariance.copy()
    P[6:, :6] = _faded(habit, covariance[6:, :6], keep, keep_shared)
    P[:6, 6:] = P[6:, :6].T
    faded = _faded(habit, covariance[6:, 6:] - habit.covariance, keep, keep_shared)
    P[6:, 6:] = habit.covariance + _faded(habit, faded.T.copy(), keep, keep_shared)
    for a in range(3):
        P[a, a] += _TURN_RAD_SQRT_S**2 * seconds
        P[3 + a, 3 + a] += _SHIFT_M_SQRT_S**2 * seconds
    return expected, spd_inverse(P)
