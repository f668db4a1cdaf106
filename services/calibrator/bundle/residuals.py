"""Reprojection residuals of board corners, and their Jacobian by lens, camera and board. Pure.

A residual is the measured minus the projected pixel. A corner behind its camera has a NaN residual:
the adjustment never steps there, and whoever starts there sees an infinite cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.bundle.lens_model import LENS_SIZE, project, project_with_jacobians

# Unknowns of a pose: a small rotation and a translation. Of a camera: its lens and its extrinsics.
POSE_SIZE = 6
CAMERA_SIZE = LENS_SIZE + POSE_SIZE
# Columns of the Jacobian: the unknowns of a corner's camera, then those of its board.
_LENS = slice(0, 9)
_CAMERA_ROTATION, _CAMERA_TRANSLATION = slice(9, 12), slice(12, 15)
_BOARD_ROTATION, _BOARD_TRANSLATION = slice(15, 18), slice(18, 21)


@dataclass(frozen=True, eq=False)
class View:
    """The corners of one board position in the picture of one camera.

    `camera` and `board` are positions in the arrays of a State: a board held in another place
    counts as another board.
    """

    camera: int
    board: int
    ids: np.ndarray  # (n,) numbers of the corners
    points: Array  # (n, 3) metres, board frame
    pixels: Array  # (n, 2)


@dataclass(frozen=True, eq=False)
class State:
    """What the adjustment estimates: lenses, extrinsics of the cameras, poses of the boards."""

    lenses: Array  # (c, 9)
    T_camera_from_rig: Array  # (c, 4, 4)
    T_rig_from_board: Array  # (b, 4, 4)


@dataclass(frozen=True, eq=False)
class Corners:
    """The corners of all views in one array each; view k ends before ends[k]."""

    points: Array  # (n, 3)
    pixels: Array  # (n, 2)
    camera: np.ndarray  # (n,)
    board: np.ndarray  # (n,)
    ends: np.ndarray  # (v,)


def stack_corners(views: list[View]) -> Corners:
    """The corners of all views, one view after the other."""
    counts = [len(view.points) for view in views]
    return Corners(
        points=np.concatenate([view.points for view in views]),
        pixels=np.concatenate([view.pixels for view in views]),
        camera=np.repeat([view.camera for view in views], counts),
        board=np.repeat([view.board for view in views], counts),
        ends=np.cumsum(counts),
    )


def residuals(corners: Corners, state: State) -> Array:
    """Measured minus projected pixels (n, 2) of all corners; NaN behind the camera."""
    T = state.T_camera_from_rig[corners.camera] @ state.T_rig_from_board[corners.board]
    p_camera = np.einsum("nij,nj->ni", T[:, :3, :3], corners.points) + T[:, :3, 3]
    return corners.pixels - project(state.lenses[corners.camera], p_camera)


def split_by_view(corners: Corners, rows: Array) -> tuple[Array, ...]:
    """The rows (n, ...) of all corners, view by view."""
    return tuple(np.split(rows, corners.ends[:-1]))


def view_residuals(views: list[View], state: State) -> tuple[Array, ...]:
    """The residuals (n, 2) px of each view."""
    corners = stack_corners(views)
    return split_by_view(corners, residuals(corners, state))


def residuals_and_jacobian(corners: Corners, state: State) -> tuple[Array, Array]:
    """The residuals (n, 2) of all corners, and the Jacobian (n, 2, 21) of their projections.

    Columns: lens 9, then rotation 3 and translation 3 of T_camera_from_rig, then of
    T_rig_from_board. A rotation is updated from the left, exp(w) R.
    """
    T_cr, T_rb = state.T_camera_from_rig[corners.camera], state.T_rig_from_board[corners.board]
    R_cr = T_cr[:, :3, :3]
    # The points turned, but not yet shifted: into the rig's axes, then into the camera's.
    in_rig = np.einsum("nij,nj->ni", T_rb[:, :3, :3], corners.points)
    in_camera = np.einsum("nij,nj->ni", R_cr, in_rig + T_rb[:, :3, 3])
    pixels, J_point, J_lens = project_with_jacobians(
        state.lenses[corners.camera], in_camera + T_cr[:, :3, 3]
    )
    J_rig_point = J_point @ R_cr
    J = np.empty((len(in_rig), 2, CAMERA_SIZE + POSE_SIZE))
    J[:, :, _LENS] = J_lens
    # d(exp(w) v)/dw = -[v]x, and u^T (-[v]x) = (v x u)^T.
    J[:, :, _CAMERA_ROTATION] = _cross(in_camera[:, None, :], J_point)
    J[:, :, _CAMERA_TRANSLATION] = J_point
    J[:, :, _BOARD_ROTATION] = _cross(in_rig[:, None, :], J_rig_point)
    J[:, :, _BOARD_TRANSLATION] = J_rig_point
    return corners.pixels - pixels, J


def _cross(a: Array, b: Array) -> Array:
    """a x b along the last axis; numpy's own takes four times as long."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def rms(errors: Array) -> float:
    """Root mean square length of the rows of `errors` (n, 2 or 3); 0 of none."""
    return float(np.sqrt(np.mean(np.sum(errors * errors, axis=-1)))) if len(errors) else 0.0


def rms_by_board(views: list[View], errors: tuple[Array, ...], count: int) -> list[float]:
    """RMS px of each of `count` board positions over all its views, from the views' residuals."""
    by_board: list[list[Array]] = [[] for _ in range(count)]
    for view, error in zip(views, errors, strict=True):
        by_board[view.board].append(error)
    return [rms(np.concatenate(each)) if each else 0.0 for each in by_board]
