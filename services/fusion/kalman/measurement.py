"""The measurement update of an extended Kalman filter: one camera's ray of one landmark.

The measurement is the undistorted ray (x/z, y/z) of a pixel, so lenses are already out of it. Its
error has two parts: the pixel's own, and the camera's clock, which turns the landmark's velocity
into an error along its path in the image. Compiled. Nothing here raises: a landmark predicted
behind the camera, or nearer than projection.NEAR_M, gives NOT_VISIBLE and leaves the estimate as it
was.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import project
from services.fusion.kalman.motion_model import Gaussian

# Log-likelihood standing for "this camera cannot see that point".
NOT_VISIBLE = -1e300
LOG_2PI = math.log(2.0 * math.pi)


class Measurement(NamedTuple):
    """One ray, and the camera that measured it."""

    R: Array  # (3, 3) of T_camera_from_rig
    t: Array  # (3,) of T_camera_from_rig, m
    ray: Array  # (2,) undistorted x/z, y/z
    ray_variance: float  # of each ray coordinate
    clock_variance: float  # of the camera's clock, s^2


class Innovation(NamedTuple):
    """What a measurement says about a state (9,), with its weight; arrays are written in place."""

    H: Array  # (2, 3) Jacobian of the ray by the position; by the rest of the state it is 0
    nu: Array  # (2,) the innovation: measured minus predicted ray
    S_inverse: Array  # (2, 2) inverse of the innovation's covariance
    K: Array  # (9, 2) Kalman gain


@njit(cache=True, error_model="numpy")
def innovate(predicted: Gaussian, measured: Measurement, out: Innovation) -> float:
    """The innovation of a predicted state (9,), not applied yet; returns its log-likelihood.

    NOT_VISIBLE, and no innovation of use, if the state is not in front of the camera.
    """
    H, nu, S_inverse, K = out.H, out.nu, out.S_inverse, out.K
    P = predicted.cov  # (9, 9)
    predicted_ray = np.empty(2)
    if not project(predicted.mean, measured.R, measured.t, predicted_ray, H):
        return NOT_VISIBLE
    # Innovation.
    for k in range(2):
        nu[k] = measured.ray[k] - predicted_ray[k]
    # Innovation covariance S = H P H^T + noise.
    PHt = K  # (9, 2) P H^T stands where the gain is to come, to save an allocation.
    for i in range(9):
        for k in range(2):
            PHt[i, k] = P[i, 0] * H[k, 0] + P[i, 1] * H[k, 1] + P[i, 2] * H[k, 2]
    determinant = _invert_innovation_cov(predicted.mean, measured, H, PHt, S_inverse)
    if not determinant > 0.0:
        return NOT_VISIBLE
    # Gain K = P H^T S^-1.
    for i in range(9):
        PHt0, PHt1 = PHt[i, 0], PHt[i, 1]
        K[i, 0] = PHt0 * S_inverse[0, 0] + PHt1 * S_inverse[1, 0]
        K[i, 1] = PHt0 * S_inverse[0, 1] + PHt1 * S_inverse[1, 1]
    return -0.5 * (mahalanobis_squared(nu, S_inverse) + math.log(determinant)) - LOG_2PI


@njit(cache=True, error_model="numpy")
def _invert_innovation_cov(
    state: Array, measured: Measurement, H: Array, PHt: Array, S_inverse: Array
) -> float:
    """The inverse of S = H P H^T + R, written in place; returns det(S), not positive if singular.

    R is the ray's variance along both axes, and the clock's along the path in the image.
    """
    ray_variance, clock_variance = measured.ray_variance, measured.clock_variance
    # Velocity of the ray (1/s): what a clock error of one second would shift it by.
    du = H[0, 0] * state[3] + H[0, 1] * state[4] + H[0, 2] * state[5]
    dv = H[1, 0] * state[3] + H[1, 1] * state[4] + H[1, 2] * state[5]
    S00 = _row_times_column(H, PHt, 0, 0) + ray_variance + clock_variance * du * du
    S01 = _row_times_column(H, PHt, 0, 1) + clock_variance * du * dv
    S11 = _row_times_column(H, PHt, 1, 1) + ray_variance + clock_variance * dv * dv
    determinant = S00 * S11 - S01 * S01
    if determinant > 0.0:
        S_inverse[0, 0] = S11 / determinant
        S_inverse[1, 1] = S00 / determinant
        S_inverse[0, 1] = -S01 / determinant
        S_inverse[1, 0] = S_inverse[0, 1]
    return determinant


@njit(cache=True, error_model="numpy")
def _row_times_column(H: Array, PHt: Array, k: int, n: int) -> float:
    """Element (k, n) of H P H^T, which the position alone makes up."""
    return H[k, 0] * PHt[0, n] + H[k, 1] * PHt[1, n] + H[k, 2] * PHt[2, n]


@njit(cache=True, error_model="numpy")
def mahalanobis_squared(nu: Array, S_inverse: Array) -> float:
    """nu^T S^-1 nu of an innovation (2,), the normalised innovation squared: 2 in expectation."""
    return (
        nu[0] * nu[0] * S_inverse[0, 0]
        + 2.0 * nu[0] * nu[1] * S_inverse[0, 1]
        + nu[1] * nu[1] * S_inverse[1, 1]
    )


@njit(cache=True, error_model="numpy")
def update(state: Gaussian, innovation: Innovation) -> None:
    """The posterior, in place: x += K nu, P -= K H P, kept symmetric."""
    H, nu, K = innovation.H, innovation.nu, innovation.K
    x, P = state.mean, state.cov
    HP = np.empty((2, 9))
    for k in range(2):
        for j in range(9):
            HP[k, j] = H[k, 0] * P[0, j] + H[k, 1] * P[1, j] + H[k, 2] * P[2, j]
    for i in range(9):
        x[i] += K[i, 0] * nu[0] + K[i, 1] * nu[1]
        for j in range(i, 9):
            P[i, j] -= K[i, 0] * HP[0, j] + K[i, 1] * HP[1, j]
            P[j, i] = P[i, j]


@njit(cache=True, error_model="numpy")
def adjoint_update(rows: Array, count: int, innovation: Innovation) -> int:
    """The step back over one measurement, in place: from after its update to before it.

    rows (n, 9), of which count are known: the adjoint, and a factor G^T of the information G G^T.
    Every row g becomes (I - K H)^T g; of the adjoint H^T S^-1 nu is taken off, and the information
    gains H^T S^-1 H: two rows more. Returns how many are known then; a measurement that was passed
    over tells nothing.
    """
    H, nu, S_inverse, K = innovation.H, innovation.nu, innovation.S_inverse, innovation.K
    S00, S01, S11 = S_inverse[0, 0], S_inverse[0, 1], S_inverse[1, 1]
    if not S00 > 0.0:
        return count
    for n in range(count):
        w0, w1 = 0.0, 0.0
        for i in range(9):
            w0 += K[i, 0] * rows[n, i]
            w1 += K[i, 1] * rows[n, i]
        if n == 0:
            w0 += S00 * nu[0] + S01 * nu[1]
            w1 += S01 * nu[0] + S11 * nu[1]
        for i in range(3):
            rows[n, i] -= H[0, i] * w0 + H[1, i] * w1
    # The Cholesky factor of S^-1.
    L00 = math.sqrt(S00)
    L10 = S01 / L00
    L11 = math.sqrt(max(S11 - L10 * L10, 0.0))
    rows[count : count + 2, 3:] = 0.0
    for i in range(3):
        rows[count, i] = H[0, i] * L00 + H[1, i] * L10
        rows[count + 1, i] = H[1, i] * L11
    return count + 2
