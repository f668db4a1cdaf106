"""Where a camera sees the centre of a painted finger tip, against the landmark on the bone's axis.

The tip is a capsule (radius of the paint) that ends in a half ball, painted over extent_m from its
end; the landmark is the middle of the painted stretch of the axis. Seen from afar, the centroid of
what is visible lies off the landmark along the finger's direction in the image, by an amount that
depends only on the angle between finger and viewing ray: `centroid_shift`. What that does to a
point located from several cameras follows by least squares: `located_shift`. Skin is taken as
evenly bright; nothing else hides the paint. Compiled.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.normal_equations import invert_symmetric, multiply
from services.fusion.geometry.projection import Extrinsics, project

# Angles of the table, 0 to 180 deg: 3 deg apart, linear between them is right to 20 um for a 7 mm
# finger.
_ANGLES = 61
# Rays per radius in each direction: edges are then known to 1 / 40 radius, the centroid to 10 um.
_FINENESS = 40


@njit(cache=True)
def _centroid_shift(radius_m: float, extent_m: float, sine: float, cosine: float) -> float:
    """centroid_shift by ray-casting: parallel rays over a grid.

    The finger points along (sine, 0, cosine), rays along (0, 0, 1); u is a ray's x, w its y.
    """
    step = radius_m / _FINENESS
    half = 0.5 * extent_m + radius_m
    n_u = int(half / step) + 1
    # From the landmark to the centre of the end's ball.
    centre_u = (0.5 * extent_m - radius_m) * sine
    area = 0.0
    moment = 0.0
    for i in range(-n_u, n_u + 1):
        u = i * step - centre_u
        for j in range(_FINENESS):
            w = (j + 0.5) * step
            z = _first_hit(u, w, radius_m, sine, cosine)
            # Painted: no further than extent_m from the end.
            if z < np.inf and u * sine + z * cosine >= radius_m - extent_m:
                area += 1.0
                moment += i * step
    return moment / area if area > 0.0 else 0.0


@njit(cache=True)
def _first_hit(u: float, w: float, radius_m: float, sine: float, cosine: float) -> float:
    """z at which the ray through (u, w) meets the capsule; infinite if it does not.

    The centre of the capsule's ball is the origin; its cylinder runs away from (sine, 0, cosine).
    """
    z = np.inf
    inside = radius_m**2 - u * u - w * w
    if inside > 0.0:
        z = -math.sqrt(inside)
    # Cylinder about the finger's direction d: |q|^2 - (q.d)^2 = r^2 for q = (u, w, z), on the side
    # away from the end.
    a = sine * sine
    b = -u * sine * cosine
    c = u * u * (1.0 - sine * sine) + w * w - radius_m**2
    discriminant = b * b - a * c
    if a > 1e-9 and discriminant > 0.0:
        side = (-b - math.sqrt(discriminant)) / a
        if side < z and u * sine + side * cosine <= 0.0:
            z = side
    return z


@njit(cache=True)
def _fill_table(radius_m: float, extent_m: float, table: Array) -> None:
    for k in range(table.shape[0]):
        angle = math.pi * k / (table.shape[0] - 1)
        table[k] = _centroid_shift(radius_m, extent_m, math.sin(angle), math.cos(angle))


def shift_table(radius_m: float, extent_m: float) -> Array:
    """centroid_shift for angles from 0 (the finger points away) to pi (it points at the camera).

    (61,) m, zero for flat dabs.
    """
    table = np.zeros(_ANGLES)
    if radius_m > 0.0 and extent_m > 0.0:
        _fill_table(radius_m, extent_m, table)
    return table


@njit(cache=True)
def centroid_shift(table: Array, cosine: float) -> float:
    """Metres from the landmark to the visible centroid, towards the finger's end.

    cosine: of the angle between finger and viewing ray.
    """
    place = math.acos(min(1.0, max(-1.0, cosine))) / math.pi * (table.shape[0] - 1)
    k = min(int(place), table.shape[0] - 2)
    return table[k] + (place - k) * (table[k + 1] - table[k])


@njit(cache=True)
def located_shift(
    table: Array, p_rig: Array, direction: Array, cameras: Extrinsics, shift: Array
) -> bool:
    """Where the cameras locate the visible centroid, minus the landmark p_rig (3,); to shift (3,).

    direction (3,) is the finger's, towards its end, of unit length. Least squares over the cameras'
    rays. False if they cannot locate it.
    """
    H, A_inverse, work = np.empty((cameras.R.shape[0], 2, 3)), np.empty((3, 3)), np.empty((2, 3))
    if not _sights(p_rig, cameras, H, A_inverse):
        return False
    _least_squares(table, p_rig, direction, cameras, (H, A_inverse), work, shift)
    return True


@njit(cache=True)
def _sights(p_rig: Array, cameras: Extrinsics, H: Array, A_inverse: Array) -> bool:
    """What does not depend on a finger's direction: H (C, 2, 3) of the rays by a point p_rig (3,).

    And the inverse of H^T H (3, 3), summed over the cameras. False if they cannot locate it.
    """
    A, ray = np.zeros((3, 3)), np.empty(2)
    for c in range(H.shape[0]):
        if not project(p_rig, cameras.R[c], cameras.t[c], ray, H[c]):
            return False
        for k in range(2):
            for i in range(3):
                for j in range(3):
                    A[i, j] += H[c, k, i] * H[c, k, j]
    return invert_symmetric(A, A_inverse)


@njit(cache=True)
def _least_squares(
    table: Array,
    p_rig: Array,
    direction: Array,
    cameras: Extrinsics,
    sights: tuple[Array, Array],
    work: Array,
    shift: Array,
) -> None:
    """located_shift from what _sights found; work (2, 3) is written over."""
    H, A_inverse = sights
    b, seen_shift = work[0], work[1]
    b[:] = 0.0  # H^T (shift of the ray), summed
    for c in range(H.shape[0]):
        _seen_shift(table, p_rig, direction, cameras.R[c], cameras.t[c], seen_shift)
        for k in range(2):
            ray_shift = (
                H[c, k, 0] * seen_shift[0] + H[c, k, 1] * seen_shift[1] + H[c, k, 2] * seen_shift[2]
            )
            for i in range(3):
                b[i] += H[c, k, i] * ray_shift
    multiply(A_inverse, b, shift)


@njit(cache=True)
def expected_shift(
    table: Array,
    p_rig: Array,
    finger: tuple[Array, float, float],
    cameras: Extrinsics,
    shift: Array,
    covariance: Array,
) -> bool:
    """located_shift of a finger that is not known exactly, and its covariance (3, 3).

    finger: its direction (3,), one standard deviation of that in rad about each axis across it, and
    of its radius as a share. The direction is tried so far to either side about two axes (an
    unscented transform); beyond a radian it is not known at all. False if the cameras cannot locate
    it.
    """
    direction, sigma_rad, radius_sd = finger
    H, A_inverse, work = np.empty((cameras.R.shape[0], 2, 3)), np.empty((3, 3)), np.empty((2, 3))
    if not _sights(p_rig, cameras, H, A_inverse):
        return False
    sights = H, A_inverse
    _least_squares(table, p_rig, direction, cameras, sights, work, shift)
    covariance[:] = 0.0
    # The shift of a longer or shorter stretch of paint is the same to .1 mm, that of a thicker
    # finger larger in proportion.
    _add_square(shift, radius_sd**2, covariance)
    cosine, sine = math.cos(min(sigma_rad, 1.0)), math.sin(min(sigma_rad, 1.0))
    across, turned, tried = np.empty((2, 3)), np.empty(3), np.empty(3)
    _across(direction, across)
    for n in range(4):
        sign = 1.0 if n < 2 else -1.0
        for i in range(3):
            turned[i] = cosine * direction[i] + sign * sine * across[n % 2, i]
        _least_squares(table, p_rig, turned, cameras, sights, work, tried)
        tried -= shift
        _add_square(tried, 0.5, covariance)
    return True


@njit(cache=True)
def _across(direction: Array, out: Array) -> None:
    """Two unit vectors (2, 3) across a unit direction and each other."""
    least = 0
    for i in range(1, 3):
        if abs(direction[i]) < abs(direction[least]):
            least = i
    axis = np.zeros(3)
    axis[least] = 1.0
    _cross(direction, axis, out[0])
    out[0] /= math.sqrt(out[0] @ out[0])
    _cross(direction, out[0], out[1])


@njit(cache=True)
def _cross(a: Array, b: Array, out: Array) -> None:
    """Fill out (3,) with a x b: numpy's own takes longer than all of a shift."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _add_square(v: Array, weight: float, cov: Array) -> None:
    """Add v v' times a weight to cov (3, 3)."""
    for i in range(3):
        for j in range(3):
            cov[i, j] += weight * v[i] * v[j]


@njit(cache=True)
def _seen_shift(
    table: Array, p_rig: Array, direction: Array, R: Array, t: Array, out: Array
) -> None:
    """One camera's centroid_shift as a vector across its viewing ray, in the rig frame; to out."""
    length = 0.0
    cosine = 0.0
    for i in range(3):
        # The viewing ray in the rig frame: p - centre, centre = -R^T t.
        out[i] = p_rig[i] + R[0, i] * t[0] + R[1, i] * t[1] + R[2, i] * t[2]
        length += out[i] ** 2
        cosine += out[i] * direction[i]
    length = math.sqrt(length)
    cosine /= length
    sine = math.sqrt(max(1.0 - cosine * cosine, 1e-12))
    shift = centroid_shift(table, cosine)
    for i in range(3):
        out[i] = (direction[i] - cosine * out[i] / length) / sine * shift
