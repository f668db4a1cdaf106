"""The motion of a hand's landmarks together: shared jerk, and some of each one's own.

A state (D,) of N landmarks is positions (3 N), velocities (3 N), accelerations (3 N) in the rig
frame (m, s) and, last, the error of a camera's clock (s), which lives for one frame. D = 9 N + 1.

Jerk is white noise that landmarks share: a shift of the hand, a turn about the landmarks' centroid,
and a push along the way that the hand lately came, all landmarks in proportion to their velocities:
hands start, stop and turn round along their way. What a landmark does by itself comes on top.
Velocity and acceleration fade, each at its rate. Compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools

# Nodes and weights of Gauss-Legendre quadrature on (0, 1), exact to degree 9. The smoother takes
# noise of a step for that of its parts, and what a look a millisecond later leaves of 33 ms is less
# than a ten-thousandth: with three points, exact to degree 5, that came out below nothing.
_NEAR, _FAR = (math.sqrt(5.0 + sign * 2.0 * math.sqrt(10.0 / 7.0)) / 6.0 for sign in (-1.0, 1.0))
_NODES = (0.5 - _FAR, 0.5 - _NEAR, 0.5, 0.5 + _NEAR, 0.5 + _FAR)
_OF_FAR, _OF_NEAR = ((322.0 + sign * 13.0 * math.sqrt(70.0)) / 1800.0 for sign in (-1.0, 1.0))
_WEIGHTS = (_OF_FAR, _OF_NEAR, 64.0 / 225.0, _OF_NEAR, _OF_FAR)
# Sums over a state's rows may be added up in any order, and fused: a node is filtered in 7/8 of the
# time, and three frames smoothed in 3/5. Same machine, same digits.
FAST_SUMS = {"reassoc", "contract"}
# How long a way is remembered: a hand that flaps 1.7 times a second passes a turn in .05 s. A hand
# slower than SLOW_M_S has hardly a way.
MEMORY_S, SLOW_M_S = 0.15, 0.1


# Which model is of a resting hand. One that takes another's estimate over for it stops the fingers.
RESTING = 0


class MotionModels(NamedTuple):
    """M models, from a resting hand to the liveliest; densities are of white noise."""

    velocity_rate: Array  # (M,) 1/s, at which velocity fades; may be 0
    acceleration_rate: Array  # (M,) 1/s, another one than the velocity's
    shift: Array  # (M,) of the hand's jerk, m^2/s^5
    turn: Array  # (M,) of its angular jerk, rad^2/s^5
    along: Array  # (M,) of its jerk along its way, m^2/s^5
    own: Array  # (M,) of each landmark's own jerk, m^2/s^5
    walk: Array  # (M,) of each landmark's place, m^2/s


class SharedNoise(NamedTuple):
    """What landmarks share in a step: covariances (3 N, 3 N) of their jerk for a density of 1."""

    turn: Array
    way: Array


@njit(cache=True, error_model="numpy")
def transition(
    velocity_rate: float, acceleration_rate: float, dt_s: float
) -> tuple[float, float, float, float, float, float]:
    """F of one axis over dt >= 0, [[1, f01, f02], [0, f11, f12], [0, f21, f22]], row by row.

    The exponential of [[0, 1, 0], [0, 0, 1], [0, -ab, -a - b]] dt, for rates a != b.
    """
    a, b = velocity_rate, acceleration_rate
    # 1 - exp(-a t), and that divided by a: expm1 keeps the digits of short steps.
    fade_a, fade_b = -math.expm1(-a * dt_s), -math.expm1(-b * dt_s)
    time_a = fade_a / a if a > 0.0 else dt_s
    time_b = fade_b / b
    apart = b - a
    f12 = (fade_b - fade_a) / apart
    return (
        (b * time_a - a * time_b) / apart,
        (time_a - time_b) / apart,
        1.0 - (b * fade_a - a * fade_b) / apart,
        f12,
        -a * b * f12,
        1.0 - (b * fade_b - a * fade_a) / apart,
    )


@njit(cache=True, error_model="numpy")
def unit_process_noise(rates: tuple[float, float], dt_s: float, Q: Array) -> None:
    """Q (3, 3) over dt for a jerk density of 1, of one axis; written in place.

    The integral over dt of g g^T, g = the last column of F.
    """
    Q[:] = 0.0
    for n in range(len(_NODES)):
        _, f02, _, f12, _, f22 = transition(rates[0], rates[1], dt_s * _NODES[n])
        g = (f02, f12, f22)
        for i in range(3):
            for j in range(3):
                Q[i, j] += dt_s * _WEIGHTS[n] * g[i] * g[j]


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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
def update_way(before: Array, state: Array, alive: Bools, dt_s: float, after: Array) -> None:
    """The mean of v v^T (3 N, 3 N) over recent velocities of all landmarks; written to `after`."""
    axes = before.shape[0]
    keep = math.exp(-dt_s / MEMORY_S)
    for i in range(axes):
        for j in range(axes):
            after[i, j] = keep * before[i, j]
            if alive[i // 3] and alive[j // 3]:
                after[i, j] += (1.0 - keep) * state[axes + i] * state[axes + j]


@njit(cache=True, error_model="numpy")
def predict_state(last: Array, F: Array, out: Array) -> None:
    """F x of a state (D,), F (N, 6) by landmark, to out (D,); the clock's error begins anew."""
    axes = (last.shape[0] - 1) // 3
    for i in range(axes):
        f = F[i // 3]
        v, a = last[axes + i], last[2 * axes + i]
        out[i] = last[i] + f[0] * v + f[1] * a
        out[axes + i] = f[2] * v + f[3] * a
        out[2 * axes + i] = f[4] * v + f[5] * a
    out[3 * axes] = 0.0


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def jerk_cov(models: MotionModels, m: int, shared: SharedNoise, alive: Bools) -> Array:
    """Covariance (3 N, 3 N) of the jerk of model m's landmarks, zero of those not alive."""
    axes = shared.turn.shape[0]
    turn, shift, own = models.turn[m], models.shift[m], models.own[m]
    count = alive.shape[0]
    speed = count * SLOW_M_S**2
    for i in range(axes):
        speed += shared.way[i, i]
    along = models.along[m] * count / speed
    jerk = np.empty((axes, axes))
    for i in range(axes):
        row, by_turn, by_way = jerk[i], shared.turn[i], shared.way[i]
        for j in range(axes):
            row[j] = turn * by_turn[j] + along * by_way[j]
    # By landmarks: which one an axis is of, and whether that is alive, took longer than all sums.
    for n in range(count):
        if not alive[n]:
            jerk[3 * n : 3 * n + 3] = 0.0
            continue
        for k in range(count):
            if alive[k]:
                for i in range(3):
                    jerk[3 * n + i, 3 * k + i] += shift
        for i in range(3 * n, 3 * n + 3):
            jerk[i, i] += own
    return jerk


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def predict_cov(P: Array, F: Array, jerk: Array, Q: Array, out: Array) -> None:
    """F P F^T and the noise of jerk (3 N, 3 N), to out (D, D); F (N, 6) by landmark.

    Q (3, 3): of unit_process_noise. The row and column of the clock's error become zero.
    """
    axes = jerk.shape[0]
    c01, c02, c11, c12, c21, c22 = _columns(F)
    q00, q01, q02, q11, q12, q22 = Q[0, 0], Q[0, 1], Q[0, 2], Q[1, 1], Q[1, 2], Q[2, 2]
    for i in range(axes):
        f01, f02, f11, f12, f21, f22 = c01[i], c02[i], c11[i], c12[i], c21[i], c22[i]
        p, v, a = P[i], P[axes + i], P[2 * axes + i]
        to_p, to_v, to_a, noise = out[i], out[axes + i], out[2 * axes + i], jerk[i]
        # One pass: P is read, and out written, once.
        for j in range(axes):
            vp, vv, va = v[j], v[axes + j], v[2 * axes + j]
            ap, av, aa = a[j], a[axes + j], a[2 * axes + j]
            pp = p[j] + f01 * vp + f02 * ap
            pv = p[axes + j] + f01 * vv + f02 * av
            pa = p[2 * axes + j] + f01 * va + f02 * aa
            vp, ap = f11 * vp + f12 * ap, f21 * vp + f22 * ap
            vv, av = f11 * vv + f12 * av, f21 * vv + f22 * av
            va, aa = f11 * va + f12 * aa, f21 * va + f22 * aa
            q = noise[j]
            to_p[j] = pp + c01[j] * pv + c02[j] * pa + q00 * q
            to_p[axes + j] = c11[j] * pv + c12[j] * pa + q01 * q
            to_p[2 * axes + j] = c21[j] * pv + c22[j] * pa + q02 * q
            to_v[j] = vp + c01[j] * vv + c02[j] * va + q01 * q
            to_v[axes + j] = c11[j] * vv + c12[j] * va + q11 * q
            to_v[2 * axes + j] = c21[j] * vv + c22[j] * va + q12 * q
            to_a[j] = ap + c01[j] * av + c02[j] * aa + q02 * q
            to_a[axes + j] = c11[j] * av + c12[j] * aa + q12 * q
            to_a[2 * axes + j] = c21[j] * av + c22[j] * aa + q22 * q
    out[:, 3 * axes] = 0.0
    out[3 * axes] = 0.0


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def predict_place_cov(P: Array, F: Array, jerk: Array, Q: Array, out: Array) -> None:
    """The first rows of predict_cov, (3 N, D): of places with everything."""
    axes = jerk.shape[0]
    c01, c02, c11, c12, c21, c22 = _columns(F)
    q00, q01, q02 = Q[0, 0], Q[0, 1], Q[0, 2]
    for i in range(axes):
        f01, f02 = c01[i], c02[i]
        p, v, a, to, noise = P[i], P[axes + i], P[2 * axes + i], out[i], jerk[i]
        for j in range(axes):
            pp = p[j] + f01 * v[j] + f02 * a[j]
            pv = p[axes + j] + f01 * v[axes + j] + f02 * a[axes + j]
            pa = p[2 * axes + j] + f01 * v[2 * axes + j] + f02 * a[2 * axes + j]
            q = noise[j]
            to[j] = pp + c01[j] * pv + c02[j] * pa + q00 * q
            to[axes + j] = c11[j] * pv + c12[j] * pa + q01 * q
            to[2 * axes + j] = c21[j] * pv + c22[j] * pa + q02 * q
        to[3 * axes] = 0.0


@njit(cache=True, error_model="numpy")
def _columns(F: Array) -> Array:
    """F (N, 6) by landmark as rows by element, (6, 3 N)."""
    columns = np.empty((6, 3 * F.shape[0]))
    for j in range(columns.shape[1]):
        for n in range(6):
            columns[n, j] = F[j // 3, n]
    return columns


@njit(cache=True, error_model="numpy")
def add_walk(models: MotionModels, m: int, dt_s: float, alive: Bools, P: Array) -> None:
    """Add what alive landmarks' places wander by over dt in model m to a covariance (., D)."""
    for i in range(3 * alive.shape[0]):
        if alive[i // 3]:
            P[i, i] += models.walk[m] * dt_s


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def adjoint_predict(rows: Array, count: int, F: Array) -> None:
    """The smoother's step back: F^T of each of the first count rows (n, D), F (N, 6), in place.

    What was said of the clock's error ends with its frame.
    """
    axes = (rows.shape[1] - 1) // 3
    for n in range(count):
        row = rows[n]
        for i in range(axes):
            f = F[i // 3]
            p, v, a = row[i], row[axes + i], row[2 * axes + i]
            row[axes + i] = f[0] * p + f[2] * v + f[4] * a
            row[2 * axes + i] = f[1] * p + f[3] * v + f[5] * a
        row[3 * axes] = 0.0
