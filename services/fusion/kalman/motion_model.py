"""The motion model of a landmark: position, velocity, acceleration; driven by white jerk.

Singer, "Estimating Optimal Tracking Filter Performance for Manned Maneuvering Targets", IEEE TAES
6(4), 1970: acceleration is exponentially correlated. Over one frame it is the constant-acceleration
model; over a gap the prediction does not run away. Velocity may fade as well, so that a lively
model's speed is bounded, as a hand's is: where cameras take turns, a sharp turn in one view looks
like metres a second of depth.

A state (9,) is position, velocity, acceleration in the rig frame (m, s), its covariance (9, 9).
A model (4,) is its jerk density (m^2/s^5), the rates (1/s) at which velocity and acceleration fade:
the velocity's may be 0, and they must differ; and a density that is added along the way that the
landmark came (recent_way.py). Only the first three count here. dt_s >= 0. Exact for any dt but for
the quadrature of noise: two short steps equal one long step, which the smoother relies on.
Compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

# Correlation time of a hand's acceleration. Of 0.1, 0.3 s and infinity (constant acceleration) on
# sums of sinusoids up to 1.5 and 3 Hz at 0.5 m/s RMS, 0.3 s had the smallest no-lag error (1.72 and
# 2.47 mm; infinity 1.77 and 2.54).
ACCELERATION_TIME_S = 0.3
# Nodes and weights of Gauss-Legendre quadrature on (0, 1); three points are exact to degree 5, the
# order of dt in the noise's largest term.
_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)


class Gaussian(NamedTuple):
    """A Gaussian estimate of a state; its arrays are written in place."""

    mean: Array  # (n,)
    cov: Array  # (n, n)


class Step(NamedTuple):
    """A motion model over some time; of one axis, the others are alike. Arrays written in place."""

    F: Array  # (3, 3) transition of position, velocity, acceleration; F[0, 0] = 1, F[1:, 0] = 0
    Q: Array  # (3, 3) process noise


@njit(cache=True, error_model="numpy")
def empty_step() -> Step:
    """To be filled by discretize."""
    return Step(np.empty((3, 3)), np.empty((3, 3)))


@njit(cache=True, error_model="numpy")
def transition(dt_s: float, velocity_rate: float, acceleration_rate: float, F: Array) -> None:
    """Transition F (3, 3) over dt of a velocity and an acceleration that fade; written in place.

    The exponential of A = [[0, 1, 0], [0, 0, 1], [0, -ab, -a - b]] dt, for rates a != b (1/s).
    """
    a, b = velocity_rate, acceleration_rate
    # 1 - exp(-a t), and that divided by a: expm1 keeps the digits of short steps.
    fade_a, fade_b = -math.expm1(-a * dt_s), -math.expm1(-b * dt_s)
    time_a = fade_a / a if a > 0.0 else dt_s
    time_b = fade_b / b
    apart = b - a
    F[0, 0] = 1.0
    F[1, 0] = 0.0
    F[2, 0] = 0.0
    F[0, 1] = (b * time_a - a * time_b) / apart
    F[0, 2] = (time_a - time_b) / apart
    F[1, 1] = 1.0 - (b * fade_a - a * fade_b) / apart
    F[1, 2] = (fade_b - fade_a) / apart
    F[2, 1] = -a * b * F[1, 2]
    F[2, 2] = 1.0 - (b * fade_b - a * fade_a) / apart


@njit(cache=True, error_model="numpy")
def discretize(dt_s: float, model: Array, step: Step) -> None:
    """A model (4,) over dt_s; written in place."""
    density, a, b = model[0], model[1], model[2]
    F, Q = step.F, step.Q
    Q[:] = 0.0
    for k in range(3):
        transition(dt_s * _NODES[k], a, b, F)
        weight = density * dt_s * _WEIGHTS[k]
        for i in range(3):
            for j in range(3):
                Q[i, j] += weight * F[i, 2] * F[j, 2]
    transition(dt_s, a, b, F)


@njit(cache=True, error_model="numpy")
def discretize_next(dt_s: float, models: Array, m: int, step: Step) -> None:
    """Model m of models (M, 4) over dt_s, where step is still that of model m - 1; in place.

    Models whose rates are alike differ in their noise only.
    """
    if m > 0 and models[m, 1] == models[m - 1, 1] and models[m, 2] == models[m - 1, 2]:
        Q = step.Q
        Q *= models[m, 0] / models[m - 1, 0]
    else:
        discretize(dt_s, models[m], step)


@njit(cache=True, error_model="numpy")
def predict(last: Gaussian, step: Step, predicted: Gaussian) -> None:
    """The estimate (9,), (9, 9) a step after the last: x = F x, P = F P F^T + Q; in place."""
    F, Q = step.F, step.Q
    for axis in range(3):
        p, v, a = last.mean[axis], last.mean[axis + 3], last.mean[axis + 6]
        predicted.mean[axis] = p + F[0, 1] * v + F[0, 2] * a
        predicted.mean[axis + 3] = F[1, 1] * v + F[1, 2] * a
        predicted.mean[axis + 6] = F[2, 1] * v + F[2, 2] * a
    propagate_cov(last.cov, 3, F, predicted.cov)
    for i in range(3):
        for j in range(3):
            for axis in range(3):
                predicted.cov[3 * i + axis, 3 * j + axis] += Q[i, j]


@njit(cache=True, error_model="numpy")
def propagate_cov(P: Array, axes: int, F: Array, out: Array) -> None:
    """F P F^T (3 axes, 3 axes) of positions, velocities, accelerations along `axes` directions."""
    pv, pa, vv, va, av, aa = F[0, 1], F[0, 2], F[1, 1], F[1, 2], F[2, 1], F[2, 2]
    for i in range(axes):  # F P
        for j in range(3 * axes):
            p, v, a = P[i, j], P[i + axes, j], P[i + 2 * axes, j]
            out[i, j] = p + pv * v + pa * a
            out[i + axes, j] = vv * v + va * a
            out[i + 2 * axes, j] = av * v + aa * a
    for i in range(3 * axes):  # (F P) F^T
        for j in range(axes):
            p, v, a = out[i, j], out[i, j + axes], out[i, j + 2 * axes]
            out[i, j] = p + pv * v + pa * a
            out[i, j + axes] = vv * v + va * a
            out[i, j + 2 * axes] = av * v + aa * a


@njit(cache=True, error_model="numpy")
def adjoint_predict(rows: Array, count: int, F: Array) -> None:
    """The smoother's step back over F (3, 3): F^T of each of the first count rows (n, 9)."""
    # Read once: whatever is written might be F, as far as a compiler knows.
    pv, pa, vv, va, av, aa = F[0, 1], F[0, 2], F[1, 1], F[1, 2], F[2, 1], F[2, 2]
    for n in range(count):
        for i in range(3):
            p, v, a = rows[n, i], rows[n, i + 3], rows[n, i + 6]
            rows[n, i + 3] = pv * p + vv * v + av * a
            rows[n, i + 6] = pa * p + va * v + aa * a
