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

# Nodes and weights of Gauss-Legendre quadrature on (0, 1); three points are exact to degree 5, the
# order of dt in the noise's largest term.
_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
# Sums over a state's rows may be added up in any order, and fused: a node is filtered in 7/8 of the
# time, and three frames smoothed in 3/5. Same machine, same digits.
FAST_SUMS = {"reassoc", "contract"}
# How long a way is remembered: a hand that flaps 1.7 times a second passes a turn in .05 s. A hand
# slower than SLOW_M_S has hardly a way.
MEMORY_S, SLOW_M_S = 0.15, 0.1


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
    for n in range(3):
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
def predict_cov(P: Array, F: Array, out: Array) -> None:
    """F P F^T (D, D), F (N, 6), to out; the row and column of the clock's error become zero."""
    size = P.shape[0]
    axes = (size - 1) // 3
    columns = np.empty((6, axes))
    for j in range(axes):
        for n in range(6):
            columns[n, j] = F[j // 3, n]
    c01, c02, c11, c12, c21, c22 = columns
    for i in range(axes):  # F P
        p, v, a = P[i], P[axes + i], P[2 * axes + i]
        to_p, to_v, to_a = out[i], out[axes + i], out[2 * axes + i]
        f01, f02, f11 = columns[0, i], columns[1, i], columns[2, i]
        f12, f21, f22 = columns[3, i], columns[4, i], columns[5, i]
        for j in range(size):
            to_p[j] = p[j] + f01 * v[j] + f02 * a[j]
            to_v[j] = f11 * v[j] + f12 * a[j]
            to_a[j] = f21 * v[j] + f22 * a[j]
    for i in range(3 * axes):  # (F P) F^T
        p, v, a = out[i, :axes], out[i, axes : 2 * axes], out[i, 2 * axes : 3 * axes]
        for j in range(axes):
            p[j], v[j], a[j] = (
                p[j] + c01[j] * v[j] + c02[j] * a[j],
                c11[j] * v[j] + c12[j] * a[j],
                c21[j] * v[j] + c22[j] * a[j],
            )
        out[i, 3 * axes] = 0.0
    out[3 * axes] = 0.0


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def add_noise(
    models: MotionModels, m: int, dt_s: float, shared: SharedNoise, alive: Bools, P: Array
) -> None:
    """Add model m's process noise over dt to a covariance (D, D), for landmarks that are alive."""
    axes = shared.turn.shape[0]
    Q = np.empty((3, 3))
    unit_process_noise((models.velocity_rate[m], models.acceleration_rate[m]), dt_s, Q)
    turn, shift, own = models.turn[m], models.shift[m], models.own[m]
    count = alive.shape[0]
    speed = count * SLOW_M_S**2
    for i in range(axes):
        speed += shared.way[i, i]
    along = models.along[m] * count / speed
    jerk = np.empty(axes)  # a row of the jerk's covariance
    for i in range(axes):
        if not alive[i // 3]:
            continue
        for j in range(axes):
            jerk[j] = turn * shared.turn[i, j] + along * shared.way[i, j]
        for n in range(count):
            if alive[n]:
                jerk[3 * n + i % 3] += shift
        jerk[i] += own
        for r in range(3):
            for c in range(3):
                row = P[r * axes + i, c * axes : (c + 1) * axes]
                q = Q[r, c]
                for j in range(axes):
                    row[j] += q * jerk[j]
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
