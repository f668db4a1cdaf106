"""The motion model: exact over any split of time, and the adjoint step is its transpose."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.kalman.motion_model import (
    ACCELERATION_TIME_S,
    Gaussian,
    adjoint_predict,
    discretize,
    discretize_next,
    empty_step,
    predict,
)

# One whose velocity lasts, and one whose velocity fades too; density 100.
MODELS = [np.array([100.0, 0.0, 1.0 / ACCELERATION_TIME_S]), np.array([100.0, 12.0, 25.0])]


def over(dt_s, model):
    step = empty_step()
    discretize(dt_s, model, step)
    return step


def advance(state, cov, dt_s, model):
    predicted = Gaussian(np.empty(9), np.empty((9, 9)))
    predict(Gaussian(state, cov), over(dt_s, model), predicted)
    return predicted


@pytest.fixture
def estimate() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    root = random.normal(size=(9, 9))
    return random.normal(size=9), root @ root.T


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("dt_s", [1e-6, 2.9e-4, 3.1e-4, 0.0166, 0.15])
def test_transition_is_the_matrix_exponential(dt_s, model):
    _, a, b = model
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -a * b, -a - b]])
    exponential, term = np.eye(3), np.eye(3)
    for k in range(1, 40):
        term = term @ A * dt_s / k
        exponential += term
    np.testing.assert_allclose(over(dt_s, model).F, exponential, rtol=1e-8, atol=1e-15)


@pytest.mark.parametrize("model", MODELS)
def test_prediction_is_the_textbook_formula(estimate, model):
    state, cov = estimate
    step = over(0.02, model)
    F = np.kron(step.F, np.eye(3))
    new_state, new_cov = advance(state, cov, 0.02, model)
    np.testing.assert_allclose(new_state, F @ state, atol=1e-12)
    np.testing.assert_allclose(new_cov, F @ cov @ F.T + np.kron(step.Q, np.eye(3)), atol=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_two_short_steps_equal_a_long_one(estimate, model):
    whole = advance(*estimate, 0.1, model)
    halves = advance(*advance(*estimate, 0.03, model), 0.07, model)
    np.testing.assert_allclose(whole[0], halves[0], rtol=1e-12)
    # What is left is the noise's quadrature.
    np.testing.assert_allclose(whole[1], halves[1], rtol=1e-7 if model[1] == 0.0 else 2e-3)


def test_models_of_one_kind_differ_in_their_noise_only():
    models = np.array([[1.0, 0.0, 3.0], [7.0, 0.0, 3.0], [7.0, 5.0, 9.0]])
    step = empty_step()
    for m, model in enumerate(models):
        discretize_next(0.02, models, m, step)
        np.testing.assert_allclose(step.F, over(0.02, model).F)
        np.testing.assert_allclose(step.Q, over(0.02, model).Q, rtol=1e-12)


def test_a_velocity_that_fades_is_bounded():
    """Expected: the spread of acceleration and velocity that white jerk settles at."""
    density, a, b = MODELS[1]
    state, cov = np.zeros(9), np.zeros((9, 9))
    for _ in range(200):
        state, cov = advance(state, cov, 0.01, MODELS[1])
    assert cov[3, 3] == pytest.approx(density / (2.0 * a * b * (a + b)), rel=1e-3)
    assert cov[6, 6] == pytest.approx(density / (2.0 * (a + b)), rel=1e-3)


def test_no_time_changes_nothing(estimate):
    state, cov = advance(*estimate, 0.0, MODELS[1])
    np.testing.assert_array_equal(state, estimate[0])
    np.testing.assert_array_equal(cov, estimate[1])


@pytest.mark.parametrize("model", MODELS)
def test_the_step_back_is_the_transpose(estimate, model):
    rows = np.vstack([estimate[0], estimate[1], np.ones(9)])
    F = over(0.05, model).F
    adjoint_predict(rows, 10, F)
    F = np.kron(F, np.eye(3))
    np.testing.assert_allclose(rows[0], F.T @ estimate[0], atol=1e-12)
    np.testing.assert_allclose(rows[1:10], estimate[1] @ F, atol=1e-12)
    np.testing.assert_array_equal(rows[10], 1.0)
