"""The motion model of a painted landmark: position, velocity and an acceleration that fades, driven
by white jerk.

Singer, "Estimating Optimal Tracking Filter Performance for Manned Maneuvering Targets", IEEE TAES
6(4), 1970: acceleration is exponentially correlated over FADE_S. Over one frame it is the
constant-acceleration model; over a gap the prediction does not run away. Compiled with numba; state
(9,) is position, velocity, acceleration in the rig frame (m, s), covariance (9, 9). dt_s >= 0.
Exact for any dt: two short steps equal one long step, which the smoother relies on.
"""

from __future__ import annotations

import math

from numba import njit

from rhot.geometry.transforms import Array

# Correlation time of a hand's acceleration. Of 0.1, 0.3 s and infinity (constant acceleration) on
# sums of sinusoids up to 1.5 and 3 Hz at 0.5 m/s RMS, 0.3 s had the smallest no-lag error (1.72 and
# 2.47 mm; infinity 1.77 and 2.54).
FADE_S = 0.3
# Nodes and weights of Gauss-Legendre quadrature on (0, 1); three points are exact to degree 5, the
# order of dt in the noise's largest term.
_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)


@njit(cache=True)
def transition(dt_s: float) -> tuple[float, float, float, float]:
    """Elements of F (x identity 3x3): position from velocity and acceleration, velocity and
    acceleration from acceleration.
    """
    a = dt_s / FADE_S
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
    return dt_s, FADE_S * FADE_S * (a - 1.0 + e), FADE_S * (1.0 - e), e


@njit(cache=True)
def unit_noise(dt_s: float, out: Array) -> None:
    """Process noise (3, 3) over dt for unit jerk density: the integral of g g^T, g = last column of
    F; written to out.
    """
    out[:] = 0.0
    for k in range(3):
        _, g0, g1, g2 = transition(dt_s * _NODES[k])
        weight = dt_s * _WEIGHTS[k]
        out[0, 0] += weight * g0 * g0
        out[0, 1] += weight * g0 * g1
        out[0, 2] += weight * g0 * g2
        out[1, 1] += weight * g1 * g1
        out[1, 2] += weight * g1 * g2
        out[2, 2] += weight * g2 * g2
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]


@njit(cache=True)
def predict(
    state: Array,
    cov: Array,
    dt_s: float,
    density: float,
    noise: Array,
    out_state: Array,
    out_cov: Array,
) -> None:
    """State (9,) and covariance (9, 9) dt_s later: x = F x, P = F P F^T + density * noise.

    Noise (3, 3) from unit_noise.
    """
    f01, f02, f12, f22 = transition(dt_s)
    for i in range(3):
        p, v, a = state[i], state[i + 3], state[i + 6]
        out_state[i], out_state[i + 3], out_state[i + 6] = (
            p + f01 * v + f02 * a,
            v + f12 * a,
            f22 * a,
        )
    propagate(cov, 3, dt_s, out_cov)
    for i in range(3):
        for j in range(3):
            for axis in range(3):
                out_cov[3 * i + axis, 3 * j + axis] += density * noise[i, j]


@njit(cache=True)
def propagate(cov: Array, axes: int, dt_s: float, out: Array) -> None:
    """F P F^T for a covariance (3 axes, 3 axes) of positions, velocities and accelerations along
    `axes` directions, to out.
    """
    f01, f02, f12, f22 = transition(dt_s)
    for i in range(axes):
        for j in range(3 * axes):
            p, v, a = cov[i, j], cov[i + axes, j], cov[i + 2 * axes, j]
            out[i, j], out[i + axes, j], out[i + 2 * axes, j] = (
                p + f01 * v + f02 * a,
                v + f12 * a,
                f22 * a,
            )
    for i in range(3 * axes):
        for j in range(axes):
            p, v, a = out[i, j], out[i, j + axes], out[i, j + 2 * axes]
            out[i, j], out[i, j + axes], out[i, j + 2 * axes] = (
                p + f01 * v + f02 * a,
                v + f12 * a,
                f22 * a,
            )


@njit(cache=True)
def retreat(adjoint: Array, curvature: Array, dt_s: float) -> None:
    """F^T adjoint (9,) and F^T curvature F (9, 9), in place: the smoother's step back over dt_s."""
    f01, f02, f12, f22 = transition(dt_s)
    for i in range(3):
        p, v, a = adjoint[i], adjoint[i + 3], adjoint[i + 6]
        adjoint[i + 3], adjoint[i + 6] = f01 * p + v, f02 * p + f12 * v + f22 * a
    for i in range(3):
        for j in range(9):
            p, v, a = curvature[i, j], curvature[i + 3, j], curvature[i + 6, j]
            curvature[i + 3, j], curvature[i + 6, j] = f01 * p + v, f02 * p + f12 * v + f22 * a
    for i in range(9):
        for j in range(3):
            p, v, a = curvature[i, j], curvature[i, j + 3], curvature[i, j + 6]
            curvature[i, j + 3], curvature[i, j + 6] = f01 * p + v, f02 * p + f12 * v + f22 * a
