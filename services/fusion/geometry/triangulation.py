"""One point from the rays of two or more cameras: a linear start, then least squares on what the
cameras measured.

Hartley & Sturm, "Triangulation", CVIU 68(2), 1997: the linear solution (inhomogeneous, as the
points are never at infinity) refined by Gauss-Newton on the weighted reprojection error. Only
points are undistorted, images are never rectified. Rays that do not meet in front of the cameras
and within reach are refused by a status, with the numbers that show why.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.kalman.measurement import project

# Gauss-Newton from the linear solution is at rounding error after 3 rounds for rays within 20 sigma
# of meeting.
_ROUNDS = 5


class TriangulationStatus(Enum):
    """What became of the rays."""

    OK = "ok"
    PARALLEL = "parallel"  # no baseline, or one camera only
    BEHIND = "behind"  # they meet behind a camera
    BEYOND = "beyond"  # they meet further away than max_distance_m


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


def extrinsics(cameras: tuple[Camera, ...]) -> tuple[Array, Array]:
    """R (C, 3, 3) and t (C, 3) of T_camera_from_rig of all cameras, for the compiled functions."""
    T = np.array([camera.T_camera_from_rig for camera in cameras]).reshape(-1, 4, 4)
    return np.ascontiguousarray(T[:, :3, :3]), np.ascontiguousarray(T[:, :3, 3])


def triangulate(
    rays: Array, sigmas: Array, R: Array, t: Array, max_distance_m: float
) -> Triangulation:
    """The point seen along rays (n, 2) with sigmas (n,) by n cameras whose T_camera_from_rig are R
    (n, 3, 3), t (n, 3).
    """
    position, cov, inverse_cov = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    rays, sigmas = (
        np.ascontiguousarray(rays, dtype=np.float64),
        np.ascontiguousarray(sigmas, dtype=np.float64),
    )
    code, chi_squared = _solve(rays, sigmas, R, t, position, cov, inverse_cov)
    status = (TriangulationStatus.OK, TriangulationStatus.PARALLEL, TriangulationStatus.BEHIND)[
        code
    ]
    if status is TriangulationStatus.OK:
        distances = np.linalg.norm(np.einsum("nij,j->ni", R, position) + t, axis=1)
        if distances.max() > max_distance_m:
            status = TriangulationStatus.BEYOND
    return Triangulation(
        status, position, cov, float(np.sqrt(chi_squared / max(2 * len(rays) - 3, 1)))
    )


@njit(cache=True)
def _solve(
    rays: Array, sigmas: Array, R: Array, t: Array, position: Array, cov: Array, A: Array
) -> tuple[int, float]:
    """Fill position and cov; returns a code (0 ok, 1 parallel, 2 behind) and chi squared."""
    n = rays.shape[0]
    b, row = np.zeros(3), np.empty(3)
    A[:] = 0.0
    for c in range(n):
        for k in range(2):
            for j in range(3):
                row[j] = R[c, k, j] - rays[c, k] * R[c, 2, j]
            value = rays[c, k] * t[c, 2] - t[c, k]
            for i in range(3):
                b[i] += row[i] * value
                for j in range(3):
                    A[i, j] += row[i] * row[j]
    if n < 2 or not invert_symmetric(A, cov):
        return 1, np.inf
    for i in range(3):
        position[i] = cov[i, 0] * b[0] + cov[i, 1] * b[1] + cov[i, 2] * b[2]
    ray, H, chi_squared = np.empty(2), np.empty((2, 3)), np.inf
    for _ in range(_ROUNDS):
        A[:], b[:], chi_squared = 0.0, 0.0, 0.0
        for c in range(n):
            if not project(position, R[c], t[c], ray, H):
                return 2, np.inf
            for k in range(2):
                left = (rays[c, k] - ray[k]) / sigmas[c]
                chi_squared += left * left
                for i in range(3):
                    b[i] += H[k, i] * left / sigmas[c]
                    for j in range(3):
                        A[i, j] += H[k, i] * H[k, j] / sigmas[c] ** 2
        if not invert_symmetric(A, cov):
            return 1, np.inf
        for i in range(3):
            position[i] += cov[i, 0] * b[0] + cov[i, 1] * b[1] + cov[i, 2] * b[2]
    return 0, chi_squared


@njit(cache=True)
def invert_symmetric(A: Array, out: Array) -> bool:
    """Inverse of a symmetric (3, 3) by cofactors; False if it is singular to working precision."""
    c00 = A[1, 1] * A[2, 2] - A[1, 2] * A[1, 2]
    c01 = A[0, 2] * A[1, 2] - A[0, 1] * A[2, 2]
    c02 = A[0, 1] * A[1, 2] - A[0, 2] * A[1, 1]
    determinant = A[0, 0] * c00 + A[0, 1] * c01 + A[0, 2] * c02
    # Two cameras 75 mm apart looking 2 m away give 1e-3 of the bound; parallel rays 1e-17.
    if not determinant > 1e-12 * A[0, 0] * A[1, 1] * A[2, 2]:
        return False
    out[0, 0], out[0, 1], out[0, 2] = c00, c01, c02
    out[1, 1] = A[0, 0] * A[2, 2] - A[0, 2] * A[0, 2]
    out[1, 2] = A[0, 1] * A[0, 2] - A[0, 0] * A[1, 2]
    out[2, 2] = A[0, 0] * A[1, 1] - A[0, 1] * A[0, 1]
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]
    out /= determinant
    return True
