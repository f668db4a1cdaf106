"""The measurement update of a hand's joint state: one camera's ray of one of its landmarks.

The landmark is seen delay_s after the state's time, so the ray depends on its place, velocity and
acceleration; and on the error of the camera's clock, which all rays of a frame share: the state's
last element. Compiled; nothing here raises.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import project_at
from services.fusion.kalman.motion.motion_models import FAST_SUMS

_LOG_2PI = math.log(2.0 * math.pi)
Shift = tuple[float, float, float]


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
    K: Array  # (2, D) Kalman gain, transposed; before take(), P H^T
    distance: Array  # (1,) squared Mahalanobis distance


@njit(cache=True, error_model="numpy")
def predict_ray(x: Array, look: Look, shift: Shift, out: Innovation) -> bool:
    """H, drift and nu of a look, by a state (D,); False if it is not in front of the camera.

    H is of the landmark's place shifted by so much (m), and nu what follows from it for the state.
    """
    axes = (x.shape[0] - 1) // 3
    first = 3 * look.landmark
    delay_s, half = look.delay_s, 0.5 * look.delay_s * look.delay_s
    place_x = x[first] + delay_s * x[axes + first] + half * x[2 * axes + first]
    place_y = x[first + 1] + delay_s * x[axes + first + 1] + half * x[2 * axes + first + 1]
    place_z = x[first + 2] + delay_s * x[axes + first + 2] + half * x[2 * axes + first + 2]
    place_x, place_y, place_z = place_x + shift[0], place_y + shift[1], place_z + shift[2]
    if not project_at(place_x, place_y, place_z, look.R, look.t, out.nu, out.H):
        return False
    for k in range(2):
        out.drift[k], along = 0.0, 0.0
        for i in range(3):
            out.drift[k] += out.H[k, i] * x[axes + first + i]
            along += out.H[k, i] * shift[i]
        out.nu[k] = look.ray[k] - out.nu[k] + along - out.drift[k] * x[3 * axes]
    return True


@njit(cache=True, error_model="numpy")
def innovate(x: Array, P: Array, taken: Array, known: int, look: Look, out: Innovation) -> float:
    """The innovation of a look by a state (D,), (D, D); returns det(S).

    Of the frame's looks that take() took, P knows nothing yet: what they say of it are the first
    `known` rows of taken (n, D). Of the clock's error P knows its own variance only. The
    determinant is not positive, and the innovation of no use, if the landmark is not in front of
    the camera.
    """
    if not predict_ray(x, look, (0.0, 0.0, 0.0), out):
        return 0.0
    cross_cov(P, taken, known, look, out)
    determinant = invert_innovation_cov(out.K, look, out)
    if determinant > 0.0:
        out.distance[0] = squared_distance(out)
    return determinant


@njit(cache=True, error_model="numpy")
def squared_distance(innovation: Innovation) -> float:
    """Squared Mahalanobis distance of an innovation."""
    nu, S_inverse = innovation.nu, innovation.S_inverse
    return float(
        nu[0] * nu[0] * S_inverse[0, 0]
        + 2.0 * nu[0] * nu[1] * S_inverse[0, 1]
        + nu[1] * nu[1] * S_inverse[1, 1]
    )


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def take(x: Array, taken: Array, known: int, innovation: Innovation) -> int:
    """The posterior mean (D,) by an innovation, in place; K becomes the gain.

    The covariance loses w w^T of two rows w that are added to taken (n, D): once for all looks of a
    frame, by shrink(). Returns how many rows are known now.
    """
    nu, S_inverse = innovation.nu, innovation.S_inverse
    L00, L10, L11 = _factor(S_inverse)
    K0, K1, W0, W1 = innovation.K[0], innovation.K[1], taken[known], taken[known + 1]
    S00, S01, S11 = S_inverse[0, 0], S_inverse[0, 1], S_inverse[1, 1]
    nu0, nu1 = nu[0], nu[1]
    for i in range(x.shape[0]):
        PHt0, PHt1 = K0[i], K1[i]
        W0[i] = PHt0 * L00 + PHt1 * L10
        W1[i] = PHt1 * L11
        K0[i] = PHt0 * S00 + PHt1 * S01
        K1[i] = PHt0 * S01 + PHt1 * S11
        x[i] += K0[i] * nu0 + K1[i] * nu1
    return known + 2


@njit(cache=True, error_model="numpy")
def shrink(P: Array, taken: Array, known: int) -> None:
    """What all looks of a frame (take) take off a covariance (D, D), in place."""
    rows = taken[:known]
    P -= rows.T @ rows


@njit(cache=True, error_model="numpy")
def log_likelihood(innovation: Innovation, determinant: float) -> float:
    """Of a look, by its innovation."""
    return -0.5 * (innovation.distance[0] + math.log(determinant)) - _LOG_2PI


@njit(cache=True, error_model="numpy", fastmath=FAST_SUMS)
def cross_cov(P: Array, taken: Array, known: int, look: Look, innovation: Innovation) -> None:
    """P H^T of the whole state, transposed (2, D), to K; taken rows count, as in innovate()."""
    H, drift = innovation.H, innovation.drift
    axes = (P.shape[0] - 1) // 3
    delay_s, half = look.delay_s, 0.5 * look.delay_s * look.delay_s
    p, v = 3 * look.landmark, 3 * look.landmark + axes
    a = v + axes
    p0, p1, p2 = P[p], P[p + 1], P[p + 2]
    v0, v1, v2 = P[v], P[v + 1], P[v + 2]
    a0, a1, a2 = P[a], P[a + 1], P[a + 2]
    to0, to1 = innovation.K[0], innovation.K[1]
    H00, H01, H02 = H[0, 0], H[0, 1], H[0, 2]
    H10, H11, H12 = H[1, 0], H[1, 1], H[1, 2]
    for j in range(3 * axes):
        s0 = p0[j] + delay_s * v0[j] + half * a0[j]
        s1 = p1[j] + delay_s * v1[j] + half * a1[j]
        s2 = p2[j] + delay_s * v2[j] + half * a2[j]
        to0[j] = H00 * s0 + H01 * s1 + H02 * s2
        to1[j] = H10 * s0 + H11 * s1 + H12 * s2
    to0[3 * axes] = drift[0] * P[3 * axes, 3 * axes]
    to1[3 * axes] = drift[1] * P[3 * axes, 3 * axes]
    for n in range(0, known, 2):
        row, next_row = taken[n], taken[n + 1]
        w00, w01 = _along(row, look, H, drift)
        w10, w11 = _along(next_row, look, H, drift)
        for j in range(3 * axes + 1):
            to0[j] -= w00 * row[j] + w10 * next_row[j]
            to1[j] -= w01 * row[j] + w11 * next_row[j]


@njit(cache=True, error_model="numpy")
def _along(row: Array, look: Look, H: Array, drift: Array) -> tuple[float, float]:
    """H of the whole state times a row (D,)."""
    axes = (row.shape[0] - 1) // 3
    half = 0.5 * look.delay_s * look.delay_s
    first, second = drift[0] * row[3 * axes], drift[1] * row[3 * axes]
    for i in range(3):
        at = 3 * look.landmark + i
        moved = row[at] + look.delay_s * row[axes + at] + half * row[2 * axes + at]
        first += H[0, i] * moved
        second += H[1, i] * moved
    return first, second


@njit(cache=True, error_model="numpy")
def invert_innovation_cov(PHt: Array, look: Look, out: Innovation) -> float:
    """The inverse of S = H P H^T + noise, in place; returns det(S), not positive if singular."""
    S00, across = _along(PHt[0], look, out.H, out.drift)
    _, S11 = _along(PHt[1], look, out.H, out.drift)
    S00 += look.ray_variance
    S11 += look.ray_variance
    determinant = S00 * S11 - across * across
    if determinant > 0.0:
        out.S_inverse[0, 0] = S11 / determinant
        out.S_inverse[1, 1] = S00 / determinant
        out.S_inverse[0, 1] = -across / determinant
        out.S_inverse[1, 0] = -across / determinant
    return float(determinant)


@njit(cache=True, error_model="numpy")
def _factor(S_inverse: Array) -> tuple[float, float, float]:
    """The Cholesky factor of (2, 2): its elements 00, 10, 11."""
    L00 = math.sqrt(S_inverse[0, 0])
    L10 = S_inverse[0, 1] / L00
    return L00, L10, math.sqrt(max(S_inverse[1, 1] - L10 * L10, 0.0))


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
    L00, L10, L11 = _factor(S_inverse)
    rows[count : count + 2] = 0.0
    for r in range(3):
        for i in range(3):
            at = r * axes + first + i
            rows[count, at] = orders[r] * (H[0, i] * L00 + H[1, i] * L10)
            rows[count + 1, at] = orders[r] * H[1, i] * L11
    rows[count, 3 * axes] = drift[0] * L00 + drift[1] * L10
    rows[count + 1, 3 * axes] = drift[1] * L11
    return count + 2
