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
from rhot.kernels.packed import unowned
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
def _sights(p_rig: Array, cameras: Extrinsics, rays: Array, weights: Array) -> bool:
    """What does not depend on a finger's direction: how cameras locate a point p_rig (3,).

    To rays (C, 3) their unit vectors towards it, to weights (C, 3, 3) how a shift seen by each
    moves the point of least squares. False if they cannot locate it.
    """
    A, A_inverse, ray, H = np.zeros((3, 3)), np.empty((3, 3)), np.empty(2), np.empty((2, 3))
    for c in range(rays.shape[0]):
        R, t, away = cameras.R[c], cameras.t[c], rays[c]
        if not project(p_rig, R, t, ray, H):
            return False
        for i in range(3):
            # From the camera's centre, -R^T t.
            away[i] = p_rig[i] + R[0, i] * t[0] + R[1, i] * t[1] + R[2, i] * t[2]
            for j in range(3):
                weights[c, i, j] = H[0, i] * H[0, j] + H[1, i] * H[1, j]
                A[i, j] += weights[c, i, j]
        length = math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)
        for i in range(3):
            away[i] /= length
    if not invert_symmetric(A, A_inverse):
        return False
    column = np.empty(3)
    for c in range(rays.shape[0]):
        for j in range(3):
            for i in range(3):
                column[i] = weights[c, i, j]
            multiply(A_inverse, column, weights[c, :, j])
    return True


@njit(cache=True)
def _located(table: Array, direction: Array, rays: Array, weights: Array, shift: Array) -> None:
    """Where the cameras locate the visible centroid, minus the landmark; to shift (3,).

    direction (3,) is the finger's, towards its end, of unit length; the others as of _sights.
    """
    shift[:] = 0.0
    for c in range(rays.shape[0]):
        x, y, z = rays[c]
        cosine = x * direction[0] + y * direction[1] + z * direction[2]
        sine = math.sqrt(max(1.0 - cosine * cosine, 1e-12))
        # Across the viewing ray, towards the finger's end.
        far = centroid_shift(table, cosine) / sine
        x = far * (direction[0] - cosine * x)
        y = far * (direction[1] - cosine * y)
        z = far * (direction[2] - cosine * z)
        for i in range(3):
            shift[i] += weights[c, i, 0] * x + weights[c, i, 1] * y + weights[c, i, 2] * z


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
    count = cameras.R.shape[0]
    work = Work(np.empty((count, 3)), np.empty((count, 3, 3)), np.empty((2, 3)), np.empty((4, 3)))
    return _expected_shift(table, p_rig, finger, cameras, work, shift, covariance)


class Work(NamedTuple):
    """Memory for expected_shift by C cameras."""

    rays: Array  # (C, 3)
    weights: Array  # (C, 3, 3)
    across: Array  # (2, 3)
    shifts: Array  # (4, 3)


@njit(cache=True)
def _expected_shift(
    table: Array,
    p_rig: Array,
    finger: Finger,
    cameras: Extrinsics,
    work: Work,
    shift: Array,
    covariance: Array,
) -> bool:
    """The same, with memory to work in."""
    rays, weights, across, shifts = unowned(work)
    if not _sights(p_rig, cameras, rays, weights):
        return False
    cross(finger.hinge, finger.direction, across[0])
    across[1] = finger.hinge
    straight, one, other, turned = shifts[0], shifts[1], shifts[2], shifts[3]
    _located(table, finger.direction, rays, weights, straight)
    for i in range(3):
        shift[i] = straight[i] / 3.0
    covariance[:] = 0.0
    for axis in range(2):
        angle = math.sqrt(3.0) * finger.sigmas_rad[axis]
        cosine, sine = math.cos(angle), math.sin(angle)
        for side, out in ((-sine, one), (sine, other)):
            for i in range(3):
                turned[i] = cosine * finger.direction[i] + side * across[axis, i]
            _located(table, turned, rays, weights, out)
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
