"""How well measured points form a rigid board, and rays an epipolar geometry. Pure.

The points are those of rhot.geometry.triangulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array


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
