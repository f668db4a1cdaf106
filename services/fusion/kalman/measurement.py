"""One camera's view of one landmark, taken into the estimate: the update step of an extended Kalman
filter.

The measurement is the undistorted ray (x/z, y/z) of a pixel, so lenses are already out of it. Its
error has two parts: the pixel's own and the camera's clock, which turns the landmark's velocity
into an image error along the path. Compiled with numba; nothing here raises: a landmark predicted
behind the camera, or nearer than NEAR_M, gives NOT_VISIBLE and leaves the estimate as it was.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

# Log-likelihood standing for "this camera cannot see that point".
NOT_VISIBLE = -1e300
# No hand works closer to the lens than this; the projection's derivative grows without bound there.
NEAR_M = 0.02
_LOG_2PI = math.log(2.0 * math.pi)


@njit(cache=True)
def project(p_rig: Array, R: Array, t: Array, ray: Array, H: Array) -> bool:
    """Ray (2,) of a point (3,) and its derivative H (2, 3).

    R (3, 3) and t (3,) are T_camera_from_rig. False if not in front.
    """
    x = R[0, 0] * p_rig[0] + R[0, 1] * p_rig[1] + R[0, 2] * p_rig[2] + t[0]
    y = R[1, 0] * p_rig[0] + R[1, 1] * p_rig[1] + R[1, 2] * p_rig[2] + t[1]
    z = R[2, 0] * p_rig[0] + R[2, 1] * p_rig[1] + R[2, 2] * p_rig[2] + t[2]
    if not z > NEAR_M:
        return False
    ray[0], ray[1] = x / z, y / z
    for j in range(3):
        H[0, j] = (R[0, j] - ray[0] * R[2, j]) / z
        H[1, j] = (R[1, j] - ray[1] * R[2, j]) / z
    return True


@njit(cache=True)
def innovate(
    state: Array,
    cov: Array,
    R: Array,
    t: Array,
    seen: Array,
    variances: Array,
    H: Array,
    nu: Array,
    Si: Array,
    gain: Array,
) -> float:
    """Innovation nu (2,), the inverse of its covariance Si (2, 2), gain (9, 2) and log-likelihood
    of seen (2,), not applied yet.

    variances (2,): of each ray coordinate, and of the camera's clock in s^2. nu^T Si nu is the
    normalised innovation squared.
    """
    ray, variance, clock_variance = np.empty(2), variances[0], variances[1]
    if not project(state, R, t, ray, H):
        return NOT_VISIBLE
    for i in range(9):
        for k in range(2):
            gain[i, k] = cov[i, 0] * H[k, 0] + cov[i, 1] * H[k, 1] + cov[i, 2] * H[k, 2]
    nu[0], nu[1] = seen[0] - ray[0], seen[1] - ray[1]
    # Image velocity: what a clock error of one second would shift the ray by.
    du = H[0, 0] * state[3] + H[0, 1] * state[4] + H[0, 2] * state[5]
    dv = H[1, 0] * state[3] + H[1, 1] * state[4] + H[1, 2] * state[5]
    a = (
        H[0, 0] * gain[0, 0]
        + H[0, 1] * gain[1, 0]
        + H[0, 2] * gain[2, 0]
        + variance
        + clock_variance * du * du
    )
    b = (
        H[0, 0] * gain[0, 1]
        + H[0, 1] * gain[1, 1]
        + H[0, 2] * gain[2, 1]
        + clock_variance * du * dv
    )
    d = (
        H[1, 0] * gain[0, 1]
        + H[1, 1] * gain[1, 1]
        + H[1, 2] * gain[2, 1]
        + variance
        + clock_variance * dv * dv
    )
    determinant = a * d - b * b
    if not determinant > 0.0:
        return NOT_VISIBLE
    Si[0, 0], Si[1, 1] = d / determinant, a / determinant
    Si[0, 1] = Si[1, 0] = -b / determinant
    for i in range(9):
        g0, g1 = gain[i, 0], gain[i, 1]
        gain[i, 0], gain[i, 1] = g0 * Si[0, 0] + g1 * Si[0, 1], g0 * Si[0, 1] + g1 * Si[1, 1]
    return -0.5 * (distance_squared(nu, Si) + math.log(determinant)) - _LOG_2PI


@njit(cache=True)
def distance_squared(nu: Array, Si: Array) -> float:
    """nu^T Si nu of an innovation (2,): 2 in expectation."""
    return nu[0] * nu[0] * Si[0, 0] + 2.0 * nu[0] * nu[1] * Si[0, 1] + nu[1] * nu[1] * Si[1, 1]


@njit(cache=True)
def correct(state: Array, cov: Array, H: Array, nu: Array, gain: Array) -> None:
    """Apply an innovation in place: x += K nu, P -= K H P, kept symmetric."""
    HP = np.empty((2, 9))
    for k in range(2):
        for j in range(9):
            HP[k, j] = H[k, 0] * cov[0, j] + H[k, 1] * cov[1, j] + H[k, 2] * cov[2, j]
    for i in range(9):
        state[i] += gain[i, 0] * nu[0] + gain[i, 1] * nu[1]
        for j in range(i, 9):
            cov[i, j] -= gain[i, 0] * HP[0, j] + gain[i, 1] * HP[1, j]
            cov[j, i] = cov[i, j]


@njit(cache=True)
def retract(adjoint: Array, curvature: Array, H: Array, nu: Array, Si: Array, gain: Array) -> None:
    """The smoother's step back over one measurement, in place: adjoint (9,) and curvature (9, 9)
    from after it to before it.

    Modified Bryson-Frazier recursion (Bierman, "Fixed interval smoothing with discrete
    measurements", Int. J. Control 18(1), 1973): the same estimate as Rauch-Tung-Striebel without
    inverting a covariance.
    """
    AK = np.empty((9, 2))
    for i in range(9):
        for k in range(2):
            total = 0.0
            for j in range(9):
                total += curvature[i, j] * gain[j, k]
            AK[i, k] = total
    W, w = np.empty((2, 2)), np.empty(2)
    for k in range(2):
        w[k] = Si[k, 0] * nu[0] + Si[k, 1] * nu[1]
        for j in range(9):
            w[k] += gain[j, k] * adjoint[j]
        for n in range(2):
            W[k, n] = Si[k, n]
            for j in range(9):
                W[k, n] += gain[j, k] * AK[j, n]
    for i in range(3):
        adjoint[i] -= H[0, i] * w[0] + H[1, i] * w[1]
        for j in range(9):
            cross = AK[j, 0] * H[0, i] + AK[j, 1] * H[1, i]
            curvature[i, j] -= cross
            curvature[j, i] -= cross
        for j in range(3):
            curvature[i, j] += H[0, i] * (W[0, 0] * H[0, j] + W[0, 1] * H[1, j]) + H[1, i] * (
                W[1, 0] * H[0, j] + W[1, 1] * H[1, j]
            )
