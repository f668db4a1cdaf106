"""The shared motion: exact for any step, and noise that moves a hand as a hand moves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from services.fusion.joint.hand_filter import MODELS
from services.fusion.joint.motion_models import (
    add_noise,
    adjoint_predict,
    predict_cov,
    predict_state,
    transition,
    turn_gram,
    unit_process_noise,
)


def matrix(rate: float, dt_s: float) -> np.ndarray:
    """F (3, 3) of one axis."""
    F = transition(rate, dt_s)
    return np.array([[1.0, F.f01, F.f02], [0.0, F.f11, F.f12], [0.0, F.f21, F.f22]])


@pytest.mark.parametrize("rate", [3.0, 12.0])
@pytest.mark.parametrize("dt_s", [0.0, 1e-5, 3e-4, 0.01, 0.5])
def test_transition_is_the_exponential_of_the_dynamics(rate, dt_s):
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -(rate**2), -2.0 * rate]])
    np.testing.assert_allclose(matrix(rate, dt_s), expm(A * dt_s), rtol=1e-8, atol=1e-14)


def test_two_steps_have_the_noise_of_one():
    first, second, whole = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    unit_process_noise(6.0, 0.01, first)
    unit_process_noise(6.0, 0.02, second)
    unit_process_noise(6.0, 0.03, whole)
    F = matrix(6.0, 0.02)
    np.testing.assert_allclose(F @ first @ F.T + second, whole, rtol=1e-3)


def test_a_turn_moves_landmarks_about_their_centroid():
    random = np.random.default_rng(1)
    state = np.append(random.normal(size=36), 0.0)
    alive = np.array([True, False, True, True])
    gram = np.empty((12, 12))
    turn_gram(state, alive, gram)
    places = state[:12].reshape(4, 3)
    arms = (places - places[alive].mean(axis=0)) * alive[:, None]
    # Columns: what a turn about x, y, z moves each landmark by.
    D = np.stack([np.cross(axis, arms).ravel() for axis in np.eye(3)], axis=1)  # (12, 3)
    np.testing.assert_allclose(gram, D @ D.T, atol=1e-12)


def test_prediction_is_that_of_the_dense_matrices():
    random = np.random.default_rng(2)
    root = random.normal(size=(19, 19))
    P, x = root @ root.T, random.normal(size=19)
    dense = np.zeros((19, 19))
    dense[:18, :18] = np.kron(matrix(3.0, 0.02), np.eye(6))
    out_x, out_P = np.empty(19), np.empty((19, 19))
    F = transition(3.0, 0.02)
    predict_state(x, F, out_x)
    predict_cov(P, F, out_P)
    np.testing.assert_allclose(out_x, dense @ x, rtol=1e-12)
    np.testing.assert_allclose(out_P, dense @ P @ dense.T, rtol=1e-10, atol=1e-12)
    adjoint, information = x.copy(), P.copy()
    adjoint_predict(adjoint, information, F)
    np.testing.assert_allclose(adjoint, dense.T @ x, rtol=1e-12)
    np.testing.assert_allclose(information, dense.T @ P @ dense, rtol=1e-10, atol=1e-12)


def test_noise_is_shared_by_those_that_are_alive():
    alive = np.array([True, True, False])
    gram, P = np.zeros((9, 9)), np.zeros((28, 28))
    add_noise(MODELS, 1, 0.02, gram, alive, P)
    assert (
        P[18, 18]
        > P[18, 21]
        > 0.9 * P[18, 18] * MODELS.shift[1] / (MODELS.shift[1] + MODELS.own[1])
    )
    assert P[18, 19] == 0.0
    assert not P[24:27].any()
