"""How well measured points form a rigid board, and rays an epipolar geometry. Pure.

The points are those of rhot.geometry.triangulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array


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
