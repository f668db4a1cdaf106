"""Points from the rays of several calibrated cameras, and how well they fit a rigid board. Pure.

A NaN ray (a pixel outside the lens model) gives a NaN point. A point behind a camera comes back as
it is: its residual shows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array

# The second round has the depths; the third changes less than rounding.
_ROUNDS = 3
# Depths nearer than this count as this: a micrometre from the camera's centre no pixel is certain.
_MIN_DEPTH_M = 1e-6


def triangulate(T_camera_from_rig: Array, rays: Array, focals_px: Array) -> Array:
    """Points (n, 3) in the rig frame from rays (c, n, 2) of cameras at T (c, 4, 4).

    Residuals are weighted by focal lengths in px: one for each camera (c,), or one for each ray
    (c, n), where 0 leaves a ray out.

    Iterated linear triangulation (Hartley & Sturm, "Triangulation", 1997, section 5): each round
    divides an equation by the depth it had before, so that what is minimised are pixels.
    """
    cameras, count = rays.shape[:2]
    focals = focals_px if focals_px.ndim == 2 else focals_px[:, None]
    focals = np.broadcast_to(focals, (cameras, count))
    # Two equations for each ray, (x P3 - P1) X = 0 and (y P3 - P2) X = 0.
    rows = T_camera_from_rig[:, None, :2, :]
    third = T_camera_from_rig[:, None, None, 2, :]
    equations = rays[..., None] * third - rows  # (c, n, 2, 4)
    weight = focals
    points = np.zeros((count, 3))
    for _ in range(_ROUNDS):
        weighted = equations * weight[:, :, None, None]
        A = weighted.transpose(1, 0, 2, 3).reshape(count, 2 * cameras, 4)
        normal = np.einsum("nij,nik->njk", A[..., :3], A[..., :3])
        right = -np.einsum("nij,ni->nj", A[..., :3], A[..., 3])
        points = np.linalg.solve(normal, right[..., None])[..., 0]
        depth = (
            np.einsum("cj,nj->cn", T_camera_from_rig[:, 2, :3], points)
            + T_camera_from_rig[:, None, 2, 3]
        )
        weight = focals / np.maximum(np.abs(depth), _MIN_DEPTH_M)
    return points


@dataclass(frozen=True, eq=False)
class RigidFit:
    """The rigid motion that brings a board nearest to measured points, and what it leaves over.

    scale is how much larger the measured points are than the board; the fit itself does not scale.
    """

    R_measured_from_board: Array  # (3, 3)
    t: Array  # (3,)
    errors: Array  # (n, 3) measured minus fitted points, in the board's frame and units
    scale: float


def rigid_fit(board: Array, measured: Array) -> RigidFit:
    """The rotation and translation that bring board points (n, 3) nearest to measured ones (n, 3).

    Kabsch, "A solution for the best rotation to relate two sets of vectors" (1976).
    """
    centred_board = board - board.mean(axis=0)
    centred_measured = measured - measured.mean(axis=0)
    U, _, Vt = np.linalg.svd(centred_board.T @ centred_measured)
    # A reflection is no rotation: the weakest direction is turned round.
    sign = np.sign(np.linalg.det(U @ Vt))
    R = (U @ np.diag([1.0, 1.0, sign]) @ Vt).T
    rotated = centred_board @ R.T
    # By regression on the board, which is exact: the mean length of noisy sides is always too long.
    scale = float(np.sum(centred_measured * rotated) / np.sum(centred_board * centred_board))
    t = measured.mean(axis=0) - R @ board.mean(axis=0)
    return RigidFit(R, t, (centred_measured - rotated) @ R, scale)


def epipolar_px(
    T_second_from_first: Array, rays_first: Array, rays_second: Array, focal_px: float
) -> Array:
    """Distance in px (n,) of the second camera's rays (n, 2) from the first's epipolar lines.

    Hartley & Zisserman, "Multiple View Geometry", section 9.6: l = E x, in undistorted pixels.
    """
    R, t = T_second_from_first[:3, :3], T_second_from_first[:3, 3]
    first = np.concatenate([rays_first, np.ones((len(rays_first), 1))], axis=1)
    second = np.concatenate([rays_second, np.ones((len(rays_second), 1))], axis=1)
    lines = np.cross(t, first @ R.T)
    return (
        focal_px
        * np.sum(lines * second, axis=1)
        / np.maximum(np.linalg.norm(lines[:, :2], axis=1), 1e-12)
    )
