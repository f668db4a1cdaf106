"""Held-out metric error of a rig: boards it was not calibrated with, triangulated. Pure.

The triangulated corners are compared with the rigid board. A board seen by one camera only cannot
be triangulated and does not count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array, inverse, transform
from rhot.geometry.triangulation import triangulate
from services.calibrator.board.board import Board
from services.calibrator.bundle.adjust import FreeUnknowns, adjust
from services.calibrator.bundle.lens_model import FX, FY, rays_from_pixels
from services.calibrator.bundle.residuals import State, View, rms
from services.calibrator.bundle.rigid_fit import RigidFit, epipolar_px, rigid_fit

# A rigid fit through fewer corners would follow their noise.
_MIN_CORNERS = 6


@dataclass(frozen=True)
class HeldOutError:
    """One triangulated board against the best rigid board.

    fit_squares: RMS distance of the corners from the rigid board, in sides of its squares.
    square_ratio: the measured side of the squares over the true one. reprojection_px: RMS of the
    rigid board in the pictures. epipolar_px: RMS distance from the epipolar lines. distance_m: mean
    distance from the first camera.
    """

    fit_squares: float
    square_ratio: float
    reprojection_px: float
    epipolar_px: float
    distance_m: float


class _Triangulated(NamedTuple):
    """Corners that all cameras see: rays, points in the rig frame, and the board fitted to them."""

    T_camera_from_rig: Array  # (c, 4, 4)
    focals_px: Array  # (c,)
    rays: Array  # (c, n, 2)
    points: Array  # (n, 3)
    fit: RigidFit


def held_out_error(views: list[View], state: State, board: Board) -> HeldOutError | None:
    """The error of one board position, whose views these are.

    None if no two cameras see the same six corners.
    """
    measured = _triangulated(views, state, board)
    if measured is None:
        return None
    T = measured.T_camera_from_rig
    epipolar = [
        epipolar_px(
            T[k] @ inverse(T[0]),
            measured.rays[0],
            measured.rays[k],
            float(np.sqrt(measured.focals_px[0] * measured.focals_px[k])),
        )
        for k in range(1, len(views))
    ]
    distances_m = np.linalg.norm(measured.points - inverse(T[0])[:3, 3], axis=1)
    T_rig_from_board = transform(measured.fit.R_measured_from_board, measured.fit.t)
    return HeldOutError(
        fit_squares=_fit_squares(measured, board),
        square_ratio=measured.fit.scale,
        reprojection_px=_reprojection_px(views, state, T_rig_from_board),
        epipolar_px=float(np.sqrt(np.mean(np.square(epipolar)))),
        distance_m=float(distances_m.mean()),
    )


def held_out_fit_squares(views: list[View], state: State, board: Board) -> float | None:
    """HeldOutError.fit_squares alone, which is quicker."""
    measured = _triangulated(views, state, board)
    return _fit_squares(measured, board) if measured else None


def _fit_squares(measured: _Triangulated, board: Board) -> float:
    return rms(measured.fit.errors) / board.square_m


def _triangulated(views: list[View], state: State, board: Board) -> _Triangulated | None:
    """The board from the corners that all views show; None if these are too few."""
    ids = _common_ids(views)
    if len(views) < 2 or len(ids) < _MIN_CORNERS:
        return None
    cameras = [view.camera for view in views]
    rays = np.stack([_rays(view, ids, state) for view in views])  # (c, n, 2)
    finite = np.all(np.isfinite(rays), axis=(0, 2))
    if np.count_nonzero(finite) < _MIN_CORNERS:
        return None
    ids, rays = ids[finite], rays[:, finite]
    T_camera_from_rig = state.T_camera_from_rig[cameras]
    focals_px = state.lenses[cameras][:, [FX, FY]].mean(axis=1)
    points = triangulate(T_camera_from_rig, rays, focals_px)
    fit = rigid_fit(board.points[ids], points)
    return _Triangulated(T_camera_from_rig, focals_px, rays, points, fit)


def _reprojection_px(views: list[View], state: State, T_rig_from_board: Array) -> float:
    """RMS px of the board in all its pictures, at the pose that fits them best."""
    alone = [replace(view, board=0) for view in views]
    start = replace(state, T_rig_from_board=T_rig_from_board[None])
    return adjust(alone, start, FreeUnknowns.boards_only(len(state.lenses))).rms_px


def _common_ids(views: list[View]) -> np.ndarray:
    """Numbers (n,) of the corners that all views show."""
    ids = views[0].ids
    for view in views[1:]:
        ids = np.intersect1d(ids, view.ids)
    return ids


def _rays(view: View, ids: np.ndarray, state: State) -> Array:
    """Rays (n, 2) of these corners in a view."""
    positions = np.searchsorted(view.ids, ids)
    return rays_from_pixels(state.lenses[view.camera], view.pixels[positions])
