"""The motion model: exact over any split of time, and the adjoint step is its transpose."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.kalman.motion_model import (
    ACCELERATION_TIME_S,
    Gaussian,
    adjoint_predict,
    predict,
    transition,
    unit_process_noise,
)


def matrix(dt_s: float) -> np.ndarray:
    f01, f02, f12, f22 = transition(dt_s)
    return np.kron(np.array([[1.0, f01, f02], [0.0, 1.0, f12], [0.0, 0.0, f22]]), np.eye(3))


def advance(state, cov, dt_s, density):
    unit_Q, predicted = np.empty((3, 3)), Gaussian(np.empty(9), np.empty((9, 9)))
    unit_process_noise(dt_s, unit_Q)
    predict(Gaussian(state, cov), dt_s, density, unit_Q, predicted)
    return predicted


@pytest.fixture
def estimate() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    root = random.normal(size=(9, 9))
    return random.normal(size=9), root @ root.T


@pytest.mark.parametrize("dt_s", [1e-6, 2.9e-4, 3.1e-4, 0.0166, 0.15])
def test_transition_is_the_matrix_exponential(dt_s):
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / ACCELERATION_TIME_S]])
    exponential, term = np.eye(3), np.eye(3)
    for k in range(1, 20):
        term = term @ A * dt_s / k
        exponential += term
    np.testing.assert_allclose(matrix(dt_s)[::3, ::3], exponential, rtol=1e-9, atol=1e-15)


def test_prediction_is_the_textbook_formula(estimate):
    state, cov = estimate
    F, unit_Q = matrix(0.02), np.empty((3, 3))
    unit_process_noise(0.02, unit_Q)
    new_state, new_cov = advance(state, cov, 0.02, 7.0)
    np.testing.assert_allclose(new_state, F @ state, atol=1e-12)
    np.testing.assert_allclose(
        new_cov, F @ cov @ F.T + 7.0 * np.kron(unit_Q, np.eye(3)), atol=1e-12
    )


def test_two_short_steps_equal_a_long_one(estimate):
    whole = advance(*estimate, 0.1, 100.0)
    halves = advance(*advance(*estimate, 0.03, 100.0), 0.07, 100.0)
    np.testing.assert_allclose(whole[0], halves[0], rtol=1e-12)
    np.testing.assert_allclose(whole[1], halves[1], rtol=1e-7)


def test_no_time_changes_nothing(estimate):
    state, cov = advance(*estimate, 0.0, 1e4)
    np.testing.assert_array_equal(state, estimate[0])
    np.testing.assert_array_equal(cov, estimate[1])


def test_the_step_back_is_the_transpose(estimate):
    adjoint, information = estimate[0].copy(), estimate[1].copy()
    adjoint_predict(adjoint, information, 0.05)
    F = matrix(0.05)
    np.testing.assert_allclose(adjoint, F.T @ estimate[0], atol=1e-12)
    np.testing.assert_allclose(information, F.T @ estimate[1] @ F, atol=1e-12)
