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
from services.fusion.geometry.projection import project
from services.fusion.kalman.motion_models import FAST_SUMS

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
    K: Array  # (2, D) Kalman gain, transposed; before apply(), P H^T
    distance: Array  # (1,) squared Mahalanobis distance


@njit(cache=True, error_model="numpy")
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
def innovate(x: Array, P: Array, look: Look, out: Innovation) -> float:
    """The innovation of a look by a state (D,), (D, D); returns det(S).

    Not positive, and no innovation of use, if the landmark is not in front of the camera.
    """
    if not predict_ray(x, look, out):
        return 0.0
    _cross_cov(P, look, out, out.K)
    determinant = _invert_innovation_cov(out.K, look, out)
    if determinant > 0.0:
        nu, S_inverse = out.nu, out.S_inverse
        out.distance[0] = (
            nu[0] * nu[0] * S_inverse[0, 0]
            + 2.0 * nu[0] * nu[1] * S_inverse[0, 1]
            + nu[1] * nu[1] * S_inverse[1, 1]
        )
    return determinant


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def apply(x: Array, P: Array, innovation: Innovation) -> None:
    """The posterior of a state (D,), (D, D) by an innovation, in place; K becomes the gain."""
    nu, S_inverse, K = innovation.nu, innovation.S_inverse, innovation.K
    size = x.shape[0]
    PHt0, PHt1 = K[0].copy(), K[1].copy()
    for i in range(size):
        K[0, i] = PHt0[i] * S_inverse[0, 0] + PHt1[i] * S_inverse[1, 0]
        K[1, i] = PHt0[i] * S_inverse[0, 1] + PHt1[i] * S_inverse[1, 1]
        x[i] += K[0, i] * nu[0] + K[1, i] * nu[1]
    for i in range(size):
        row = P[i]
        K0, K1 = K[0, i], K[1, i]
        for j in range(size):
            row[j] -= K0 * PHt0[j] + K1 * PHt1[j]


@njit(cache=True, error_model="numpy")
def log_likelihood(innovation: Innovation, determinant: float) -> float:
    """Of a look, by its innovation."""
    return -0.5 * (innovation.distance[0] + math.log(determinant)) - _LOG_2PI


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def adjoint_update(
    rows: Array, count: int, landmark: int, delay_s: float, innovation: Innovation
) -> int:
    """The smoother's step back over one look, in place: from after its update to before it.

    rows (n, D), of which count are known: the adjoint, and a factor G^T of the information G G^T.
    Each row g becomes (I - K H)^T g; of the adjoint H^T S^-1 nu is taken off, and the information
    gains H^T S^-1 H: two rows more. Returns how many are known then.
    """
    H, drift, nu = innovation.H, innovation.drift, innovation.nu
    S_inverse, K = innovation.S_inverse, innovation.K
    size = rows.shape[1]
    axes = (size - 1) // 3
    first = 3 * landmark
    orders = (1.0, delay_s, 0.5 * delay_s * delay_s)
    K0, K1 = K[0], K[1]
    for n in range(count):
        row = rows[n]
        w0, w1 = 0.0, 0.0
        for i in range(size):
            w0 += K0[i] * row[i]
            w1 += K1[i] * row[i]
        if n == 0:
            w0 += S_inverse[0, 0] * nu[0] + S_inverse[0, 1] * nu[1]
            w1 += S_inverse[1, 0] * nu[0] + S_inverse[1, 1] * nu[1]
        for r in range(3):
            for i in range(3):
                row[r * axes + first + i] -= orders[r] * (H[0, i] * w0 + H[1, i] * w1)
        row[3 * axes] -= drift[0] * w0 + drift[1] * w1
    # The Cholesky factor of S^-1.
    L00 = math.sqrt(S_inverse[0, 0])
    L10 = S_inverse[0, 1] / L00
    L11 = math.sqrt(max(S_inverse[1, 1] - L10 * L10, 0.0))
    rows[count : count + 2] = 0.0
    for r in range(3):
        for i in range(3):
            at = r * axes + first + i
            rows[count, at] = orders[r] * (H[0, i] * L00 + H[1, i] * L10)
            rows[count + 1, at] = orders[r] * H[1, i] * L11
    rows[count, 3 * axes] = drift[0] * L00 + drift[1] * L10
    rows[count + 1, 3 * axes] = drift[1] * L11
    return count + 2
