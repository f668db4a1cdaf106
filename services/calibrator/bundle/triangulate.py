"""Points from rays of several calibrated cameras, and how well they form a rigid board. Pure.

Rays that are NaN (pixels outside the lens model) give NaN points; a point behind a camera comes
back as it is, and its residual shows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array


def triangulate(T_camera_from_rig: Array, rays: Array, focals_px: Array) -> Array:
    """Points (n, 3) in the rig frame from rays (c, n, 2) of cameras at T (c, 4, 4), weighted by
    their focal lengths (c,) px.

    Focal lengths may be given for every ray (c, n); 0 leaves one out.

    Iterated linear triangulation (Hartley & Sturm, "Triangulation", 1997, section 5): each round
    divides an equation by the depth it had before, so that what is minimised are pixels.
    """
    focals = np.broadcast_to(
        focals_px if focals_px.ndim == 2 else focals_px[:, None], rays.shape[:2]
    )
    weight = focals
    points = np.zeros((rays.shape[1], 3))
    # The second round has the depths; the third changes less than rounding.
    for _ in range(3):
        A = (
            rays[..., None] * T_camera_from_rig[:, None, None, 2, :]
            - T_camera_from_rig[:, None, :2, :]
        )  # (c, n, 2, 4)
        A = A * weight[:, :, None, None]
        equations = A.transpose(1, 0, 2, 3).reshape(rays.shape[1], 2 * len(rays), 4)
        normal = np.einsum("nij,nik->njk", equations[..., :3], equations[..., :3])
        right = -np.einsum("nij,ni->nj", equations[..., :3], equations[..., 3])
        points = np.linalg.solve(normal, right[..., None])[..., 0]
        depth = (
            np.einsum("cj,nj->cn", T_camera_from_rig[:, 2, :3], points)
            + T_camera_from_rig[:, None, 2, 3]
        )
        weight = focals / np.maximum(np.abs(depth), 1e-6)
    return points


@dataclass(frozen=True, eq=False)
class RigidFit:
    """errors (n, 3): measured minus fitted points, in the board's frame and units.

    scale is how much larger the measured points are than the board; the fit itself does not scale.
    """

    R_measured_from_board: Array  # (3, 3)
    t: Array  # (3,)
    errors: Array
    scale: float


def rigid_fit(board: Array, measured: Array) -> RigidFit:
    """The rotation and translation, no scale, that bring board points (n, 3) nearest to the
    measured ones (n, 3).

    Kabsch, "A solution for the best rotation to relate two sets of vectors" (1976).
    """
    a, b = board - board.mean(axis=0), measured - measured.mean(axis=0)
    U, _, Vt = np.linalg.svd(a.T @ b)
    sign = np.sign(np.linalg.det(U @ Vt))
    R = (U @ np.diag([1.0, 1.0, sign]) @ Vt).T
    # By regression on the board, which is exact: the mean length of noisy sides is always too long.
    scale = float(np.sum(b * (a @ R.T)) / np.sum(a * a))
    return RigidFit(R, measured.mean(axis=0) - R @ board.mean(axis=0), (b - a @ R.T) @ R, scale)


def epipolar_px(
    T_second_from_first: Array, rays_first: Array, rays_second: Array, focal_px: float
) -> Array:
    """Distance in px (n,) of the second camera's rays (n, 2) from the epipolar lines of the
    first's.

    Hartley & Zisserman, "Multiple View Geometry", section 9.6: l = E x, in undistorted pixels.
    """
    R, t = T_second_from_first[:3, :3], T_second_from_first[:3, 3]
    first = np.concatenate([rays_first, np.ones((len(rays_first), 1))], axis=1)
    lines = np.cross(t, first @ R.T)
    second = np.concatenate([rays_second, np.ones((len(rays_second), 1))], axis=1)
    return (
        focal_px
        * np.sum(lines * second, axis=1)
        / np.maximum(np.linalg.norm(lines[:, :2], axis=1), 1e-12)
    )
