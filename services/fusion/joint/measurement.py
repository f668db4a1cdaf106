"""The measurement update of a hand's joint state: one camera's ray of one of its landmarks.

The landmark is seen delay_s after the state's time, so the ray depends on its place, velocity and
acceleration; and on the error of the camera's clock, which all rays of a frame share: the state's
last element. Compiled; nothing here raises.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.geometry.projection import project

# Log-likelihood standing for a look that changed nothing: it is beyond the gate, or the camera
# cannot see that point.
NOT_USED = -1e300
_LOG_2PI = math.log(2.0 * math.pi)


class Look(NamedTuple):
    """One ray of one landmark, and the camera that measured it."""

    landmark: int
    delay_s: float  # after the state's time
    ray: Array  # (2,) undistorted x/z, y/z
    ray_variance: float  # of each ray coordinate
    R: Array  # (3, 3) of T_camera_from_rig
    t: Array  # (3,) of T_camera_from_rig, m


class Innovation(NamedTuple):
    """What a look says about a state (D,), with its weight; arrays are written in place."""

    H: Array  # (2, 3) Jacobian of the ray by the place
    drift: Array  # (2,) by the clock's error: the ray's own velocity
    nu: Array  # (2,) measured minus predicted ray
    S_inverse: Array  # (2, 2) inverse of the innovation's covariance
    K: Array  # (2, D) Kalman gain, transposed


@njit(cache=True)
def predict_ray(x: Array, look: Look, out: Innovation) -> bool:
    """H, drift and nu of a look, by a state (D,); False if it is not in front of the camera."""
    axes = (x.shape[0] - 1) // 3
    first = 3 * look.landmark
    place = np.empty(3)
    for i in range(3):
        p, v, a = x[first + i], x[axes + first + i], x[2 * axes + first + i]
        place[i] = p + look.delay_s * (v + 0.5 * look.delay_s * a)
    ray = np.empty(2)
    if not project(place, look.R, look.t, ray, out.H):
        return False
    for k in range(2):
        out.drift[k] = 0.0
        for i in range(3):
            out.drift[k] += out.H[k, i] * x[axes + first + i]
        out.nu[k] = look.ray[k] - ray[k] - out.drift[k] * x[3 * axes]
    return True


@njit(cache=True, error_model="numpy")
def update(x: Array, P: Array, look: Look, gate: float, out: Innovation) -> float:
    """The posterior of a state (D,), (D, D), in place; the log-likelihood of the look.

    NOT_USED, and nothing changed, if its squared Mahalanobis distance is beyond the gate or the
    landmark is not in front of the camera.
    """
    size = x.shape[0]
    if not predict_ray(x, look, out):
        return NOT_USED
    nu, S_inverse, K = out.nu, out.S_inverse, out.K
    PHt = np.empty((2, size))
    _cross_cov(P, look, out, PHt)
    determinant = _invert_innovation_cov(PHt, look, out)
    if not determinant > 0.0:
        return NOT_USED
    distance = (
        nu[0] * nu[0] * S_inverse[0, 0]
        + 2.0 * nu[0] * nu[1] * S_inverse[0, 1]
        + nu[1] * nu[1] * S_inverse[1, 1]
    )
    if not distance <= gate:
        return NOT_USED
    for i in range(size):
        K[0, i] = PHt[0, i] * S_inverse[0, 0] + PHt[1, i] * S_inverse[1, 0]
        K[1, i] = PHt[0, i] * S_inverse[0, 1] + PHt[1, i] * S_inverse[1, 1]
    for i in range(size):
        x[i] += K[0, i] * nu[0] + K[1, i] * nu[1]
    PHt0, PHt1 = PHt[0], PHt[1]
    for i in range(size):
        row = P[i]
        K0, K1 = K[0, i], K[1, i]
        for j in range(size):
            row[j] -= K0 * PHt0[j] + K1 * PHt1[j]
    return -0.5 * (distance + math.log(determinant)) - _LOG_2PI


@njit(cache=True, error_model="numpy")
def _cross_cov(P: Array, look: Look, innovation: Innovation, PHt: Array) -> None:
    """P H^T of the whole state, transposed (2, D), in place."""
    H, drift = innovation.H, innovation.drift
    size = P.shape[0]
    axes = (size - 1) // 3
    clock = P[3 * axes]
    for j in range(size):
        PHt[0, j] = drift[0] * clock[j]
        PHt[1, j] = drift[1] * clock[j]
    half = 0.5 * look.delay_s * look.delay_s
    for i in range(3):
        row = 3 * look.landmark + i
        p, v, a = P[row], P[axes + row], P[2 * axes + row]
        H0, H1 = H[0, i], H[1, i]
        for j in range(size):
            along = p[j] + look.delay_s * v[j] + half * a[j]
            PHt[0, j] += H0 * along
            PHt[1, j] += H1 * along


@njit(cache=True)
def _invert_innovation_cov(PHt: Array, look: Look, out: Innovation) -> float:
    """The inverse of S = H P H^T + noise, in place; returns det(S), not positive if singular."""
    axes = (PHt.shape[1] - 1) // 3
    half = 0.5 * look.delay_s * look.delay_s
    S = np.zeros((2, 2))
    for k in range(2):
        for n in range(2):
            S[k, n] = out.drift[k] * PHt[n, 3 * axes]
            for i in range(3):
                at = 3 * look.landmark + i
                S[k, n] += out.H[k, i] * (
                    PHt[n, at] + look.delay_s * PHt[n, axes + at] + half * PHt[n, 2 * axes + at]
                )
        S[k, k] += look.ray_variance
    across = 0.5 * (S[0, 1] + S[1, 0])
    determinant = S[0, 0] * S[1, 1] - across * across
    if determinant > 0.0:
        out.S_inverse[0, 0] = S[1, 1] / determinant
        out.S_inverse[1, 1] = S[0, 0] / determinant
        out.S_inverse[0, 1] = -across / determinant
        out.S_inverse[1, 0] = -across / determinant
    return float(determinant)


@njit(cache=True, error_model="numpy")
def adjoint_update(
    adjoint: Array, information: Array, landmark: int, delay_s: float, innovation: Innovation
) -> None:
    """The smoother's step back over one look, in place: from after its update to before it.

    adjoint (D,): (I - K H)^T adjoint - H^T S^-1 nu.
    information (D, D): (I - K H)^T information (I - K H) + H^T S^-1 H.
    """
    S_inverse, nu, K = innovation.S_inverse, innovation.nu, innovation.K
    size = adjoint.shape[0]
    information_K = np.zeros((2, size))
    w = np.empty(2)  # S^-1 nu + K^T adjoint
    W = np.empty((2, 2))  # S^-1 + K^T information K
    for i in range(size):
        row = information[i]
        K0, K1 = K[0, i], K[1, i]
        for j in range(size):
            information_K[0, j] += K0 * row[j]
            information_K[1, j] += K1 * row[j]
    for k in range(2):
        w[k] = S_inverse[k, 0] * nu[0] + S_inverse[k, 1] * nu[1]
        for n in range(2):
            W[k, n] = S_inverse[k, n]
            for j in range(size):
                W[k, n] += K[k, j] * information_K[n, j]
        for j in range(size):
            w[k] += K[k, j] * adjoint[j]
    where, rows = _nonzero_rows(landmark, delay_s, size, innovation)  # (10,), (10, 2)
    for n in range(10):
        i = where[n]
        h0, h1 = rows[n, 0], rows[n, 1]
        adjoint[i] -= h0 * w[0] + h1 * w[1]
        row = information[i]
        for j in range(size):
            row[j] -= h0 * information_K[0, j] + h1 * information_K[1, j]
    for j in range(size):
        row = information[j]
        for n in range(10):
            row[where[n]] -= information_K[0, j] * rows[n, 0] + information_K[1, j] * rows[n, 1]
    for n in range(10):
        W0 = rows[n, 0] * W[0, 0] + rows[n, 1] * W[1, 0]
        W1 = rows[n, 0] * W[0, 1] + rows[n, 1] * W[1, 1]
        for k in range(10):
            information[where[n], where[k]] += W0 * rows[k, 0] + W1 * rows[k, 1]


@njit(cache=True)
def _nonzero_rows(
    landmark: int, delay_s: float, size: int, innovation: Innovation
) -> tuple[Ints, Array]:
    """Where the Jacobian (2, D) of a ray by the state is not zero (10,), and its values (10, 2)."""
    axes = (size - 1) // 3
    where = np.empty(10, dtype=np.int64)
    rows = np.empty((10, 2))
    by_order = (1.0, delay_s, 0.5 * delay_s * delay_s)
    for r in range(3):
        for i in range(3):
            where[3 * r + i] = r * axes + 3 * landmark + i
            for k in range(2):
                rows[3 * r + i, k] = by_order[r] * innovation.H[k, i]
    where[9] = 3 * axes
    rows[9] = innovation.drift
    return where, rows
