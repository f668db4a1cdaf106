"""How right a rig is about boards it was not calibrated with: triangulate them, and compare with
the rigid board. Pure.

A board seen by one camera only cannot be triangulated and does not count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rhot.geometry.transforms import Array, inverse, transform
from rhot.geometry.triangulation import triangulate
from services.calibrator.board.board import Board
from services.calibrator.bundle.adjust import Free, adjust
from services.calibrator.bundle.lens_model import FX, FY, rays
from services.calibrator.bundle.residuals import State, View, rms
from services.calibrator.bundle.triangulate import RigidFit, epipolar_px, rigid_fit


@dataclass(frozen=True)
class BoardError:
    """One triangulated board: RMS distance of its corners from the best rigid board in squares, the
    side of its squares against the true one, RMS px of the best rigid board in the pictures, RMS
    epipolar distance in px, mean distance from the first camera in m.
    """

    fit_squares: float
    square_ratio: float
    reprojection_px: float
    epipolar_px: float
    distance_m: float


def board_error(views: list[View], state: State, board: Board) -> BoardError | None:
    """The error of one board position, whose views these are.

    None if no two cameras see the same six corners.
    """
    measured = _measured(views, state, board)
    if measured is None:
        return None
    fit, error = measured
    return replace(
        error,
        reprojection_px=_reprojection(views, state, transform(fit.R_measured_from_board, fit.t)),
    )


def fit_squares(views: list[View], state: State, board: Board) -> float | None:
    """BoardError.fit_squares alone, which is quicker."""
    measured = _measured(views, state, board)
    return measured[1].fit_squares if measured else None


def _measured(views: list[View], state: State, board: Board) -> tuple[RigidFit, BoardError] | None:
    """The triangulated board, its reprojection still missing."""
    ids = _common(views)
    if len(views) < 2 or len(ids) < 6:
        return None
    cameras = [view.camera for view in views]
    seen = np.stack([_rays_of(view, ids, state) for view in views])  # (c, n, 2)
    good = np.all(np.isfinite(seen), axis=(0, 2))
    if np.count_nonzero(good) < 6:
        return None
    ids, seen = ids[good], seen[:, good]
    places = state.T_camera_from_rig[cameras]
    focals = state.lenses[cameras][:, [FX, FY]].mean(axis=1)
    points = triangulate(places, seen, focals)
    fit = rigid_fit(board.points[ids], points)
    epipolar = [
        epipolar_px(
            places[k] @ inverse(places[0]), seen[0], seen[k], float(np.sqrt(focals[0] * focals[k]))
        )
        for k in range(1, len(views))
    ]
    distance = float(np.linalg.norm(points - inverse(places[0])[:3, 3], axis=1).mean())
    return fit, BoardError(
        fit_squares=rms(fit.errors) / board.square_m,
        square_ratio=fit.scale,
        reprojection_px=float("nan"),
        epipolar_px=float(np.sqrt(np.mean(np.square(epipolar)))),
        distance_m=distance,
    )


def _reprojection(views: list[View], state: State, T_rig_from_board: Array) -> float:
    """RMS px of the board in all its pictures, where it fits them best."""
    mine = [replace(view, board=0) for view in views]
    held = Free(np.zeros_like(state.lenses, dtype=bool), np.zeros(len(state.lenses), dtype=bool))
    return adjust(mine, replace(state, T_rig_from_board=T_rig_from_board[None]), held).rms_px


def _common(views: list[View]) -> np.ndarray:
    ids = views[0].ids
    for view in views[1:]:
        ids = np.intersect1d(ids, view.ids)
    return ids


def _rays_of(view: View, ids: np.ndarray, state: State) -> Array:
    where = np.searchsorted(view.ids, ids)
    return rays(state.lenses[view.camera], view.pixels[where])
