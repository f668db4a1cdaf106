"""Views of boards, the state that explains them, and how both depend on each other: the geometry
under the adjustment. Pure.

A corner behind its camera has a NaN error; the adjustment never goes there, and whoever starts
there sees it in the cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.bundle.lens_model import LENS_SIZE, project, project_with_derivatives

# Unknowns of a camera: nine of its lens, six of its place; of a board: six.
CAMERA_SIZE, POSE_SIZE = LENS_SIZE + 6, 6


@dataclass(frozen=True, eq=False)
class View:
    """The corners of one board position in one camera's picture: numbers ids (n,), points (n, 3) of
    the board, pixels (n, 2).
    """

    camera: int
    board: int
    ids: np.ndarray
    points: Array
    pixels: Array


@dataclass(frozen=True, eq=False)
class State:
    """Lens vectors (c, 9), camera places T_camera_from_rig (c, 4, 4), board poses T_rig_from_board
    (b, 4, 4).
    """

    lenses: Array
    T_camera_from_rig: Array
    T_rig_from_board: Array


def rms(errors: Array) -> float:
    """Root mean square length of errors (n, 2 or 3); 0 of none."""
    return float(np.sqrt(np.mean(np.sum(errors * errors, axis=-1)))) if len(errors) else 0.0


def board_rms(views: list[View], errors: tuple[Array, ...], count: int) -> list[float]:
    """RMS px of each of count board positions, over all its views."""
    mine: list[list[Array]] = [[] for _ in range(count)]
    for view, error in zip(views, errors, strict=True):
        mine[view.board].append(error)
    return [rms(np.concatenate(several)) if several else 0.0 for several in mine]


def pixel_errors(views: list[View], state: State) -> tuple[Array, ...]:
    """Measured minus projected pixels (n, 2) of each view; NaN behind the camera."""
    corners = stacked(views)
    return tuple(np.split(corner_errors(corners, state), corners.ends[:-1]))


@dataclass(frozen=True, eq=False)
class Corners:
    """The corners of all views in one array each; view k ends before ends[k]."""

    points: Array  # (n, 3)
    pixels: Array  # (n, 2)
    camera: np.ndarray  # (n,)
    board: np.ndarray  # (n,)
    ends: np.ndarray  # (v,)


def stacked(views: list[View]) -> Corners:
    """The corners of all views, one after the other."""
    counts = [len(view.points) for view in views]
    return Corners(
        np.concatenate([view.points for view in views]),
        np.concatenate([view.pixels for view in views]),
        np.repeat([view.camera for view in views], counts),
        np.repeat([view.board for view in views], counts),
        np.cumsum(counts),
    )


def corner_errors(corners: Corners, state: State) -> Array:
    """Measured minus projected pixels (n, 2) of all corners."""
    T = state.T_camera_from_rig[corners.camera] @ state.T_rig_from_board[corners.board]
    p_camera = np.einsum("nij,nj->ni", T[:, :3, :3], corners.points) + T[:, :3, 3]
    return corners.pixels - project(state.lenses[corners.camera], p_camera)


def derivatives(views: list[View], state: State) -> tuple[Array, Array]:
    """Errors (n, 2) of all corners, and the derivative of the projection (n, 2, 21) by the corner's
    camera and board.

    Columns: lens 9, then rotation 3 and translation 3 of T_camera_from_rig, then of
    T_rig_from_board.
    """
    return corner_derivatives(stacked(views), state)


def corner_derivatives(corners: Corners, state: State) -> tuple[Array, Array]:
    """As `derivatives`, of corners already stacked."""
    T_cr, T_rb = state.T_camera_from_rig[corners.camera], state.T_rig_from_board[corners.board]
    R_c = T_cr[:, :3, :3]
    turned = np.einsum("nij,nj->ni", T_rb[:, :3, :3], corners.points)
    rotated = np.einsum("nij,nj->ni", R_c, turned + T_rb[:, :3, 3])
    pixels, by_point, by_lens = project_with_derivatives(
        state.lenses[corners.camera], rotated + T_cr[:, :3, 3]
    )
    J = np.empty((len(turned), 2, CAMERA_SIZE + POSE_SIZE))
    J[:, :, :9] = by_lens
    # d(exp(w) v)/dw = -[v]x, and u^T (-[v]x) = (v x u)^T.
    J[:, :, 9:12] = _cross(rotated[:, None, :], by_point)
    J[:, :, 12:15] = by_point
    in_rig = by_point @ R_c
    J[:, :, 15:18] = _cross(turned[:, None, :], in_rig)
    J[:, :, 18:21] = in_rig
    return corners.pixels - pixels, J


def _cross(a: Array, b: Array) -> Array:
    """a x b along the last axis; numpy's own takes four times as long."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
