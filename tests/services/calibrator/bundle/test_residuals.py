"""Residuals agree with rhot.geometry.camera, and their Jacobian with finite differences."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import apply, rotation_from_vector, transform
from services.calibrator.bundle.residuals import (
    State,
    residuals_and_jacobian,
    rms_by_board,
    stack_corners,
    view_residuals,
)

STEP = 1e-6


def moved(state: State, board: int, column: int, step: float) -> State:
    """The state with one unknown of camera 1, or of a board, changed by a step."""
    lenses = state.lenses.copy()
    extrinsics = state.T_camera_from_rig.copy()
    boards = state.T_rig_from_board.copy()
    if column < 9:
        lenses[1, column] += step
    elif column < 15:
        extrinsics[1] = moved_pose(extrinsics[1], column - 9, step)
    else:
        boards[board] = moved_pose(boards[board], column - 15, step)
    return State(lenses, extrinsics, boards)


def moved_pose(T: np.ndarray, axis: int, step: float) -> np.ndarray:
    change = np.zeros(6)
    change[axis] = step
    return transform(rotation_from_vector(change[:3]) @ T[:3, :3], T[:3, 3] + change[3:])


def test_residuals_are_measured_minus_projected_by_rhots_camera(noisy_pair):
    bench, views, state = noisy_pair
    for view, residual in zip(views, view_residuals(views, state), strict=True):
        p_rig = apply(state.T_rig_from_board[view.board], view.points)
        expected = view.pixels - bench.cameras[view.camera].project(p_rig)
        np.testing.assert_allclose(residual, expected, atol=1e-9)


def test_the_jacobian_agrees_with_finite_differences(noisy_pair):
    _, views, state = noisy_pair
    view = next(view for view in views if view.camera == 1)
    _, J = residuals_and_jacobian(stack_corners([view]), state)
    for column in range(21):
        above = view_residuals([view], moved(state, view.board, column, STEP))[0]
        below = view_residuals([view], moved(state, view.board, column, -STEP))[0]
        # A residual falls where the projection rises.
        numeric = -(above - below) / (2 * STEP)
        np.testing.assert_allclose(J[:, :, column], numeric, rtol=1e-5, atol=1e-3)


def test_errors_by_board_are_over_all_its_views(noisy_pair):
    _, views, state = noisy_pair
    first = [view for view in views if view.board == 0]
    errors = tuple(np.full((4, 2), [3.0, 4.0]) * k for k in range(len(first)))
    by_board = rms_by_board(first, errors, 2)
    np.testing.assert_allclose(by_board, [5.0 * np.sqrt(0.5), 0.0])
    assert len(state.T_rig_from_board) > 1
