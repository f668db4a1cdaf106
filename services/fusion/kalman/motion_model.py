"""The motion model of a landmark: position, velocity, a fading acceleration; driven by white jerk.

Singer, "Estimating Optimal Tracking Filter Performance for Manned Maneuvering Targets", IEEE TAES
6(4), 1970: acceleration is exponentially correlated over ACCELERATION_TIME_S. Over one frame it is
the constant-acceleration model; over a gap the prediction does not run away.

A state (9,) is position, velocity, acceleration in the rig frame (m, s), its covariance (9, 9).
dt_s >= 0. Exact for any dt: two short steps equal one long step, which the smoother relies on.
Compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

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


@njit(cache=True)
def transition(dt_s: float) -> tuple[float, float, float, float]:
    """The elements f01, f02, f12, f22 of F = [[1, f01, f02], [0, 1, f12], [0, 0, f22]] (x I3)."""
    a = dt_s / ACCELERATION_TIME_S
    # Below 1e-3 the difference of nearly equal numbers would lose digits; the series' next term is
    # under 1e-10 of the value.
    if a < 1e-3:
        return (
            dt_s,
            dt_s * dt_s * (0.5 - a / 6.0 + a * a / 24.0),
            dt_s * (1.0 - 0.5 * a + a * a / 6.0),
            math.exp(-a),
        )
    e = math.exp(-a)
    return (
        dt_s,
        ACCELERATION_TIME_S * ACCELERATION_TIME_S * (a - 1.0 + e),
        ACCELERATION_TIME_S * (1.0 - e),
        e,
    )


@njit(cache=True)
def unit_process_noise(dt_s: float, Q: Array) -> None:
    """Process noise Q (3, 3) over dt for a jerk density of 1, of one axis; written in place.

    The integral over dt of g g^T, g = the last column of F.
    """
    Q[:] = 0.0
    for k in range(3):
        _, g0, g1, g2 = transition(dt_s * _NODES[k])
        weight = dt_s * _WEIGHTS[k]
        Q[0, 0] += weight * g0 * g0
        Q[0, 1] += weight * g0 * g1
        Q[0, 2] += weight * g0 * g2
        Q[1, 1] += weight * g1 * g1
        Q[1, 2] += weight * g1 * g2
        Q[2, 2] += weight * g2 * g2
    Q[1, 0] = Q[0, 1]
    Q[2, 0] = Q[0, 2]
    Q[2, 1] = Q[1, 2]


@njit(cache=True)
def predict(
    last: Gaussian, dt_s: float, density: float, unit_Q: Array, predicted: Gaussian
) -> None:
    """The estimate (9,), (9, 9) dt_s after the last: x = F x, P = F P F^T + Q; written in place.

    Q = density * unit_Q (3, 3) of unit_process_noise, alike for the three axes.
    """
    f01, f02, f12, f22 = transition(dt_s)
    for axis in range(3):
        p, v, a = last.mean[axis], last.mean[axis + 3], last.mean[axis + 6]
        predicted.mean[axis] = p + f01 * v + f02 * a
        predicted.mean[axis + 3] = v + f12 * a
        predicted.mean[axis + 6] = f22 * a
    propagate_cov(last.cov, 3, dt_s, predicted.cov)
    for i in range(3):
        for j in range(3):
            for axis in range(3):
                predicted.cov[3 * i + axis, 3 * j + axis] += density * unit_Q[i, j]


@njit(cache=True)
def propagate_cov(P: Array, axes: int, dt_s: float, out: Array) -> None:
    """F P F^T (3 axes, 3 axes) of positions, velocities, accelerations along `axes` directions."""
    f01, f02, f12, f22 = transition(dt_s)
    for i in range(axes):  # F P
        for j in range(3 * axes):
            p, v, a = P[i, j], P[i + axes, j], P[i + 2 * axes, j]
            out[i, j] = p + f01 * v + f02 * a
            out[i + axes, j] = v + f12 * a
            out[i + 2 * axes, j] = f22 * a
    for i in range(3 * axes):  # (F P) F^T
        for j in range(axes):
            p, v, a = out[i, j], out[i, j + axes], out[i, j + 2 * axes]
            out[i, j] = p + f01 * v + f02 * a
            out[i, j + axes] = v + f12 * a
            out[i, j + 2 * axes] = f22 * a


@njit(cache=True)
def adjoint_predict(adjoint: Array, information: Array, dt_s: float) -> None:
    """The smoother's step back over dt_s, in place: F^T adjoint (9,), F^T information F (9, 9)."""
    f01, f02, f12, f22 = transition(dt_s)
    for i in range(3):
        p, v, a = adjoint[i], adjoint[i + 3], adjoint[i + 6]
        adjoint[i + 3] = f01 * p + v
        adjoint[i + 6] = f02 * p + f12 * v + f22 * a
    for i in range(3):
        for j in range(9):
            p, v, a = information[i, j], information[i + 3, j], information[i + 6, j]
            information[i + 3, j] = f01 * p + v
            information[i + 6, j] = f02 * p + f12 * v + f22 * a
    for i in range(9):
        for j in range(3):
            p, v, a = information[i, j], information[i, j + 3], information[i, j + 6]
            information[i, j + 3] = f01 * p + v
            information[i, j + 6] = f02 * p + f12 * v + f22 * a
