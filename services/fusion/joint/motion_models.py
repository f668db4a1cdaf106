"""The motion of a hand's landmarks together: shared jerk, a turn and a shift of the whole hand.

A state (D,) of N landmarks is positions (3 N), velocities (3 N), accelerations (3 N) in the rig
frame (m, s) and, last, the error of a camera's clock (s), which lives for one frame. D = 9 N + 1.

Velocity returns to zero as a critically damped spring would: jerk = -a^2 v - 2 a acc + noise, so
that over a gap no landmark runs away. The noise is shared: white jerk of the hand's shift and of
its turn about the landmarks' centroid, and some of each landmark's own. So landmarks that are seen
say where those are that are not. Exact for any dt; compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools

# Nodes and weights of Gauss-Legendre quadrature on (0, 1); three points are exact to degree 5, the
# order of dt in the noise's largest term.
_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
# Below this a dt the closed forms lose digits, and the series' next term is under 1e-9.
_SERIES_BELOW = 1e-3


class MotionModels(NamedTuple):
    """M models, from a resting hand to the liveliest; densities are of white noise."""

    rate: Array  # (M,) 1/s, at which velocity returns to zero
    shift: Array  # (M,) of the hand's jerk, m^2/s^5
    turn: Array  # (M,) of its angular jerk, rad^2/s^5
    own: Array  # (M,) of each landmark's own jerk, m^2/s^5
    walk: Array  # (M,) of each landmark's place, m^2/s


class Transition(NamedTuple):
    """F (3, 3) of one axis: [[1, f01, f02], [0, f11, f12], [0, f21, f22]]."""

    f01: float
    f02: float
    f11: float
    f12: float
    f21: float
    f22: float


@njit(cache=True)
def transition(rate: float, dt_s: float) -> Transition:
    """F of a model over dt_s >= 0."""
    a = rate * dt_s
    e = math.exp(-a)
    if a < _SERIES_BELOW:
        f01 = dt_s * (1.0 - a * a / 6.0)
        f02 = dt_s * dt_s * (0.5 - a / 3.0 + a * a / 8.0)
    else:
        f01 = (2.0 - e * (2.0 + a)) / rate
        f02 = (1.0 - e * (1.0 + a)) / (rate * rate)
    return Transition(f01, f02, e * (1.0 + a), e * dt_s, -e * rate * a, e * (1.0 - a))


@njit(cache=True)
def unit_process_noise(rate: float, dt_s: float, Q: Array) -> None:
    """Q (3, 3) over dt for a jerk density of 1, of one axis; written in place.

    The integral over dt of g g^T, g = the last column of F.
    """
    Q[:] = 0.0
    g = np.empty(3)
    for n in range(3):
        F = transition(rate, dt_s * _NODES[n])
        g[0], g[1], g[2] = F.f02, F.f12, F.f22
        for i in range(3):
            for j in range(3):
                Q[i, j] += dt_s * _WEIGHTS[n] * g[i] * g[j]


@njit(cache=True)
def turn_gram(state: Array, alive: Bools, gram: Array) -> None:
    """What a turn of variance 1 about each axis moves alive landmarks by: (3 N, 3 N), in place.

    Landmarks turn about their centroid; state (D,) holds their places. Those not alive get zeros.
    """
    count = alive.shape[0]
    arms = centred(state, alive)  # (N, 3)
    gram[:] = 0.0
    for n in range(count):
        for k in range(count):
            if alive[n] and alive[k]:
                dot = arms[n, 0] * arms[k, 0] + arms[n, 1] * arms[k, 1] + arms[n, 2] * arms[k, 2]
                for i in range(3):
                    for j in range(3):
                        gram[3 * n + i, 3 * k + j] = -arms[k, i] * arms[n, j]
                    gram[3 * n + i, 3 * k + i] += dot


@njit(cache=True)
def centred(state: Array, alive: Bools) -> Array:
    """Alive landmarks' places (N, 3) about their centroid; zeros for the others."""
    count = alive.shape[0]
    arms = np.zeros((count, 3))
    number = max(np.count_nonzero(alive), 1)
    for i in range(3):
        mean = 0.0
        for n in range(count):
            if alive[n]:
                mean += state[3 * n + i] / number
        for n in range(count):
            if alive[n]:
                arms[n, i] = state[3 * n + i] - mean
    return arms


@njit(cache=True, error_model="numpy")
def predict_state(last: Array, F: Transition, out: Array) -> None:
    """F x of a state (D,), to out (D,); the clock's error begins anew."""
    axes = (last.shape[0] - 1) // 3
    for i in range(axes):
        v, a = last[axes + i], last[2 * axes + i]
        out[i] = last[i] + F.f01 * v + F.f02 * a
        out[axes + i] = F.f11 * v + F.f12 * a
        out[2 * axes + i] = F.f21 * v + F.f22 * a
    out[3 * axes] = 0.0


@njit(cache=True, error_model="numpy")
def predict_cov(P: Array, F: Transition, out: Array) -> None:
    """F P F^T (D, D), to out; the row and column of the clock's error become zero."""
    size = P.shape[0]
    axes = (size - 1) // 3
    for i in range(axes):  # F P
        p, v, a = P[i], P[axes + i], P[2 * axes + i]
        to_p, to_v, to_a = out[i], out[axes + i], out[2 * axes + i]
        for j in range(size):
            to_p[j] = p[j] + F.f01 * v[j] + F.f02 * a[j]
            to_v[j] = F.f11 * v[j] + F.f12 * a[j]
            to_a[j] = F.f21 * v[j] + F.f22 * a[j]
    for i in range(3 * axes):  # (F P) F^T
        p, v, a = out[i, :axes], out[i, axes : 2 * axes], out[i, 2 * axes : 3 * axes]
        for j in range(axes):
            p[j], v[j], a[j] = (
                p[j] + F.f01 * v[j] + F.f02 * a[j],
                F.f11 * v[j] + F.f12 * a[j],
                F.f21 * v[j] + F.f22 * a[j],
            )
        out[i, 3 * axes] = 0.0
    out[3 * axes] = 0.0


@njit(cache=True, error_model="numpy")
def add_noise(
    models: MotionModels, m: int, dt_s: float, gram: Array, alive: Bools, P: Array
) -> None:
    """Add model m's process noise over dt to a covariance (D, D), for landmarks that are alive.

    gram (3 N, 3 N) of turn_gram.
    """
    axes = gram.shape[0]
    Q = np.empty((3, 3))
    unit_process_noise(models.rate[m], dt_s, Q)
    turn, shift, own = models.turn[m], models.shift[m], models.own[m]
    jerk = np.empty(axes)  # a row of the jerk's covariance
    for i in range(axes):
        if not alive[i // 3]:
            continue
        for j in range(axes):
            jerk[j] = turn * gram[i, j]
        for n in range(alive.shape[0]):
            if alive[n]:
                jerk[3 * n + i % 3] += shift
        jerk[i] += own
        for r in range(3):
            for c in range(3):
                row = P[r * axes + i, c * axes : (c + 1) * axes]
                for j in range(axes):
                    row[j] += Q[r, c] * jerk[j]
        P[i, i] += models.walk[m] * dt_s


@njit(cache=True)
def adjoint_predict(adjoint: Array, information: Array, F: Transition) -> None:
    """The smoother's step back: F^T adjoint (D,), F^T information F (D, D), in place.

    What was said of the clock's error ends with its frame.
    """
    size = adjoint.shape[0]
    axes = (size - 1) // 3
    for i in range(axes):
        p, v, a = adjoint[i], adjoint[axes + i], adjoint[2 * axes + i]
        adjoint[axes + i] = F.f01 * p + F.f11 * v + F.f21 * a
        adjoint[2 * axes + i] = F.f02 * p + F.f12 * v + F.f22 * a
    for i in range(axes):
        p, v, a = information[i], information[axes + i], information[2 * axes + i]
        for j in range(size):
            v[j], a[j] = (
                F.f01 * p[j] + F.f11 * v[j] + F.f21 * a[j],
                F.f02 * p[j] + F.f12 * v[j] + F.f22 * a[j],
            )
    for i in range(3 * axes):
        p = information[i, :axes]
        v = information[i, axes : 2 * axes]
        a = information[i, 2 * axes : 3 * axes]
        for j in range(axes):
            v[j], a[j] = (
                F.f01 * p[j] + F.f11 * v[j] + F.f21 * a[j],
                F.f02 * p[j] + F.f12 * v[j] + F.f22 * a[j],
            )
        information[i, 3 * axes] = 0.0
    adjoint[3 * axes] = 0.0
    information[3 * axes] = 0.0
