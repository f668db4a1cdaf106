"""The normal equations: eliminating the boards changes nothing."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.bundle.normal_equations import NormalEquations, robust_cost


@pytest.fixture
def equations() -> NormalEquations:
    """Random equations of one camera (15 unknowns) and two boards, with a block-diagonal rest."""
    generator = np.random.default_rng(0)
    J = generator.normal(size=(200, 27))
    J[:100, 21:] = 0.0
    J[100:, 15:21] = 0.0
    H, g = J.T @ J, J.T @ generator.normal(size=200)
    return NormalEquations(
        cost=1.0,
        H_cameras=H[:15, :15],
        H_boards=np.stack([H[15:21, 15:21], H[21:, 21:]]),
        H_mixed=np.stack([H[:15, 15:21], H[:15, 21:]]),
        g_cameras=g[:15],
        g_boards=g[15:].reshape(2, 6),
    )


def dense(equations: NormalEquations) -> tuple[np.ndarray, np.ndarray]:
    """The same equations as one matrix (27, 27) and gradient (27,)."""
    mixed = np.concatenate(list(equations.H_mixed), axis=1)
    boards = np.zeros((12, 12))
    boards[:6, :6], boards[6:, 6:] = equations.H_boards
    H = np.block([[equations.H_cameras, mixed], [mixed.T, boards]])
    return H, np.concatenate([equations.g_cameras, equations.g_boards.reshape(-1)])


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_the_reduced_step_is_the_dense_step(equations, damping):
    H, g = dense(equations)
    step = np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
    cameras, boards = equations.solve(np.arange(15), True, damping)
    np.testing.assert_allclose(np.concatenate([cameras, boards.reshape(-1)]), step, rtol=1e-9)


def test_the_variance_is_the_diagonal_of_the_dense_inverse(equations):
    inverse = np.linalg.inv(dense(equations)[0])
    variance = equations.camera_variance(np.arange(15), True)
    np.testing.assert_allclose(variance, np.diag(inverse)[:15], rtol=1e-9)


def test_what_is_held_gets_no_step_and_no_variance(equations):
    free = np.array([2, 5])
    cameras, boards = equations.solve(free, False, 0.0)
    assert np.flatnonzero(cameras).tolist() == [2, 5]
    assert not np.any(boards)
    assert np.flatnonzero(equations.camera_variance(free, False)).tolist() == [2, 5]


def test_the_robust_cost_grows_linearly_and_is_infinite_behind_a_camera():
    assert robust_cost(np.array([0.0]), 2.0) == 0.0
    assert robust_cost(np.array([1e8]), 2.0) == pytest.approx(4.0 * 2.0 * 1e4, rel=1e-3)
    assert robust_cost(np.array([np.nan]), 2.0) == float("inf")
