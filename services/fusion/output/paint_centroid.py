"""Where cameras locate the centre of a painted finger tip, against the landmark on the bone's axis.

Each camera sees the centroid of what is visible off the landmark along the finger's direction in
the image (visible_paint.py): `centroid_shift`. What that does to a point located from several
cameras follows by least squares; `expected_shift` is that of a finger whose direction and thickness
are not known exactly. Compiled.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.normal_equations import invert_symmetric, multiply
from services.fusion.geometry.projection import Extrinsics, project


@njit(cache=True)
def centroid_shift(table: Array, cosine: float) -> float:
    """Metres from the landmark to the visible centroid, towards the finger's end.

    table: shifts_m of visible_paint.PaintTables; cosine: of the angle between finger and ray.
    """
    place = math.acos(min(1.0, max(-1.0, cosine))) / math.pi * (table.shape[0] - 1)
    k = min(int(place), table.shape[0] - 2)
    return table[k] + (place - k) * (table[k + 1] - table[k])


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
    """Where the cameras locate the visible centroid, minus the landmark p_rig (3,); to shift (3,).

    direction (3,) is the finger's, towards its end, of unit length. Least squares over the cameras'
    rays, from what _sights found; work (2, 3) is written over.
    """
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


class Finger(NamedTuple):
    """A painted finger as far as it is known; sigmas are one standard deviation."""

    direction: Array  # (3,) towards its end
    hinge: Array  # (3,) the axis about which it bends, across its direction
    sigmas_rad: Array  # (2,) of its direction, about the hinge and sideways
    radius_sd: float  # how unsure its radius is, as a share


@njit(cache=True)
def expected_shift(
    table: Array,
    p_rig: Array,
    finger: Finger,
    cameras: Extrinsics,
    shift: Array,
    covariance: Array,
) -> bool:
    """What cameras locate minus the landmark p_rig (3,): its mean (3,) and covariance (3, 3).

    By its direction and four others, turned to either side about the hinge and sideways: divided
    differences of second order (DD2 of Norgaard, Poulsen & Ravn, Automatica 36(11), 2000). Seen
    from the side, a finger has its shift at an extreme, and a turn to either side does the same:
    differences of first order, and cubature rules, call that certain. False if the cameras cannot
    locate it.
    """
    H, A_inverse, work = np.empty((cameras.R.shape[0], 2, 3)), np.empty((3, 3)), np.empty((2, 3))
    if not _sights(p_rig, cameras, H, A_inverse):
        return False
    sights = H, A_inverse
    across, turned, shifts = np.empty((2, 3)), np.empty(3), np.empty((3, 3))
    cross(finger.hinge, finger.direction, across[0])
    across[1] = finger.hinge
    straight, one, other = shifts[0], shifts[1], shifts[2]
    _least_squares(table, p_rig, finger.direction, cameras, sights, work, straight)
    for i in range(3):
        shift[i] = straight[i] / 3.0
    covariance[:] = 0.0
    for axis in range(2):
        angle = math.sqrt(3.0) * finger.sigmas_rad[axis]
        for side, out in ((-1.0, one), (1.0, other)):
            for i in range(3):
                turned[i] = (
                    math.cos(angle) * finger.direction[i] + side * math.sin(angle) * across[axis, i]
                )
            _least_squares(table, p_rig, turned, cameras, sights, work, out)
        for i in range(3):
            first, second = other[i] - one[i], other[i] + one[i] - 2.0 * straight[i]
            shift[i] += (one[i] + other[i]) / 6.0
            one[i], other[i] = first, second
        _add_square(one, 1.0 / 12.0, covariance)
        _add_square(other, 1.0 / 18.0, covariance)
    # The shift of a longer or shorter stretch of paint is the same to .1 mm, that of a thicker
    # finger larger in proportion.
    _add_square(shift, finger.radius_sd**2, covariance)
    return True


@njit(cache=True)
def cross(a: Array, b: Array, out: Array) -> None:
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
