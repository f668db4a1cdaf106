"""Triangulation of one point from the rays of two or more cameras, with covariance; compiled.

Hartley & Sturm, "Triangulation", CVIU 68(2), 1997: the linear solution (inhomogeneous, as the
points are never at infinity), then Gauss-Newton on the reprojection error, each ray weighted by its
own sigma. Only rays are undistorted, pictures are never rectified. Rays that do not meet in front
of the cameras and within reach are refused by a status, with the residual that shows why.

rhot.geometry.triangulation.triangulate is the plain one, for many points at once. It stops after
the iterated linear solution, and gives neither covariance nor status. On exact rays the two agree;
on noisy ones only this one reaches the least reprojection error. A test shows both.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.normal_equations import (
    add_equation,
    invert_symmetric,
    multiply,
    solve_symmetric,
)
from services.fusion.geometry.projection import Extrinsics, project

# Gauss-Newton from the linear solution is at rounding error after 3 rounds for rays within 20 sigma
# of meeting.
_ROUNDS = 5


class TriangulationStatus(Enum):
    """What became of the rays."""

    OK = "ok"
    PARALLEL = "parallel"  # no baseline, or one camera only
    BEHIND = "behind"  # they meet behind a camera
    BEYOND = "beyond"  # they meet further away than max_distance_m


# What _triangulate returns for each.
_OK, _PARALLEL, _BEHIND = 0, 1, 2
_STATUS = (TriangulationStatus.OK, TriangulationStatus.PARALLEL, TriangulationStatus.BEHIND)


@dataclass(frozen=True, eq=False)
class Triangulation:
    """A point in the rig frame with its covariance; both are meaningless unless status is OK.

    residual_sigma is the RMS of the reprojection residuals in units of their sigmas, per degree of
    freedom: 1 in expectation.
    """

    status: TriangulationStatus
    position_m: Array  # (3,)
    covariance_m2: Array  # (3, 3)
    residual_sigma: float


def triangulate(
    rays: Array, sigmas: Array, cameras: Extrinsics, max_distance_m: float
) -> Triangulation:
    """The point seen along rays (n, 2) with sigmas (n,) by n cameras, one for each ray."""
    rays = np.ascontiguousarray(rays, dtype=np.float64)
    sigmas = np.ascontiguousarray(sigmas, dtype=np.float64)
    position = np.zeros(3)
    cov = np.zeros((3, 3))
    code, chi_squared = _triangulate(rays, sigmas, cameras, position, cov)
    status = _STATUS[code]
    if status is TriangulationStatus.OK:
        p_cameras = np.einsum("nij,j->ni", cameras.R, position) + cameras.t  # (n, 3)
        if np.linalg.norm(p_cameras, axis=1).max() > max_distance_m:
            status = TriangulationStatus.BEYOND
    degrees_of_freedom = max(2 * len(rays) - 3, 1)
    return Triangulation(status, position, cov, float(np.sqrt(chi_squared / degrees_of_freedom)))


@njit(cache=True, error_model="numpy")
def _triangulate(
    rays: Array, sigmas: Array, cameras: Extrinsics, position: Array, cov: Array
) -> tuple[int, float]:
    """Fill position (3,) and cov (3, 3); returns _OK, _PARALLEL or _BEHIND, and chi squared."""
    if rays.shape[0] < 2 or not _linear_point(rays, cameras, position):
        return _PARALLEL, np.inf
    A = np.empty((3, 3))
    b = np.empty(3)
    step = np.empty(3)
    chi_squared = np.inf
    for _ in range(_ROUNDS):
        chi_squared = _normal_equations(rays, sigmas, cameras, position, A, b)
        if chi_squared < 0.0:
            return _BEHIND, np.inf
        if not invert_symmetric(A, cov):
            return _PARALLEL, np.inf
        multiply(cov, b, step)
        position += step
    return _OK, chi_squared


@njit(cache=True, error_model="numpy")
def _linear_point(rays: Array, cameras: Extrinsics, position: Array) -> bool:
    """The linear least-squares point of rays (n, 2), to position (3,); False if they are parallel.

    Each coordinate u of a ray gives one equation: (R_row - u R_z) p = u t_z - t_row.
    """
    R, t = cameras.R, cameras.t
    A = np.zeros((3, 3))
    b = np.zeros(3)
    row = np.empty(3)
    for c in range(rays.shape[0]):
        for k in range(2):
            for j in range(3):
                row[j] = R[c, k, j] - rays[c, k] * R[c, 2, j]
            value = rays[c, k] * t[c, 2] - t[c, k]
            add_equation(row, value, A, b)
    return solve_symmetric(A, b, position)


@njit(cache=True, error_model="numpy")
def _normal_equations(
    rays: Array, sigmas: Array, cameras: Extrinsics, position: Array, A: Array, b: Array
) -> float:
    """A = H^T W H (3, 3) and b = H^T W residual (3,) at a position; returns chi squared.

    W weighs by 1 / sigma^2. Negative if the position is behind a camera.
    """
    ray = np.empty(2)
    H = np.empty((2, 3))
    A[:] = 0.0
    b[:] = 0.0
    chi_squared = 0.0
    for c in range(rays.shape[0]):
        if not project(position, cameras.R[c], cameras.t[c], ray, H):
            return -1.0
        for k in range(2):
            residual = (rays[c, k] - ray[k]) / sigmas[c]
            chi_squared += residual * residual
            for i in range(3):
                b[i] += H[k, i] * residual / sigmas[c]
                for j in range(3):
                    A[i, j] += H[k, i] * H[k, j] / sigmas[c] ** 2
    return chi_squared
