"""The shared motion: exact for any step, and noise that moves a hand as a hand moves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from services.fusion.kalman.hand_filter import MODELS
from services.fusion.kalman.motion.motion_models import (
    SharedNoise,
    add_walk,
    adjoint_predict,
    jerk_cov,
    predict_cov,
    predict_place_cov,
    predict_state,
    transition,
    turn_gram,
    unit_process_noise,
    update_way,
)

RATES = [(0.0, 3.3), (2.9, 3.1), (15.0, 40.0)]


def matrix(rates: tuple[float, float], dt_s: float) -> np.ndarray:
    """F (3, 3) of one axis."""
    f01, f02, f11, f12, f21, f22 = transition(*rates, dt_s)
    return np.array([[1.0, f01, f02], [0.0, f11, f12], [0.0, f21, f22]])


@pytest.mark.parametrize("rates", RATES)
@pytest.mark.parametrize("dt_s", [0.0, 1e-5, 3e-4, 0.01, 0.5])
def test_transition_is_the_exponential_of_the_dynamics(rates, dt_s):
    a, b = rates
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -a * b, -a - b]])
    np.testing.assert_allclose(matrix(rates, dt_s), expm(A * dt_s), rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("rates", RATES)
def test_two_steps_have_the_noise_of_one(rates):
    first, second, whole = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    unit_process_noise(rates, 0.01, first)
    unit_process_noise(rates, 0.02, second)
    unit_process_noise(rates, 0.03, whole)
    F = matrix(rates, 0.02)
    # A look just after a long step leaves a ten-thousandth of it.
    np.testing.assert_allclose(F @ first @ F.T + second, whole, rtol=1e-6)


def test_a_way_is_that_of_the_velocities_lately():
    """Test: two landmarks move for a second, one along x and one along y, a third is not there.

    Expected: the way is v v^T, and says that both move together.
    """
    state = np.zeros(28)
    state[9], state[13] = 0.3, -0.2
    alive = np.array([True, True, False])
    way = np.zeros((9, 9))
    for _ in range(30):
        after = np.empty((9, 9))
        update_way(way, state, alive, 1.0 / 30.0, after)
        way = after
    np.testing.assert_allclose(way, np.outer(state[9:18], state[9:18]), atol=2e-4)


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
    rates = [(0.0, 3.3), (15.0, 40.0)]  # of two landmarks, one of which moves by itself
    F = np.array([transition(*each, 0.02) for each in rates])
    dense = np.zeros((19, 19))
    for k, each in enumerate(rates):
        for r, c in np.ndindex(3, 3):
            for i in range(3):
                dense[6 * r + 3 * k + i, 6 * c + 3 * k + i] = matrix(each, 0.02)[r, c]
    out_x, out_P = np.empty(19), np.empty((19, 19))
    predict_state(x, F, out_x)
    jerk_root, Q_root = random.normal(size=(6, 6)), random.normal(size=(3, 3))
    jerk, Q = jerk_root @ jerk_root.T, Q_root @ Q_root.T
    predict_cov(P, F, jerk, Q, out_P)
    noise = np.zeros((19, 19))
    noise[:18, :18] = np.kron(Q, jerk)
    np.testing.assert_allclose(out_x, dense @ x, rtol=1e-12)
    np.testing.assert_allclose(out_P, dense @ P @ dense.T + noise, rtol=1e-10, atol=1e-12)
    of_places = np.empty((6, 19))
    predict_place_cov(P, F, jerk, Q, of_places)
    np.testing.assert_allclose(of_places, out_P[:6], rtol=1e-12)
    rows = np.stack([x, P[0], P[1]])
    adjoint_predict(rows, 2, F)
    np.testing.assert_allclose(rows[0], dense.T @ x, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(rows[1], dense.T @ P[0], rtol=1e-10, atol=1e-12)
    np.testing.assert_array_equal(rows[2], P[1])


def test_jerk_is_shared_by_those_that_are_alive():
    alive = np.array([True, True, False])
    jerk = jerk_cov(MODELS, 1, SharedNoise(np.zeros((9, 9)), np.zeros((9, 9))), alive)
    assert jerk[0, 3] == MODELS.shift[1]
    assert jerk[0, 0] == MODELS.shift[1] + MODELS.own[1]
    assert jerk[0, 1] == 0.0
    assert not jerk[6:].any()
    P = np.zeros((9, 28))
    add_walk(MODELS, 0, 0.02, alive, P)
    assert P[0, 0] == P[5, 5] == 0.02 * MODELS.walk[0] > P[6, 6] == 0.0


def test_jerk_along_a_way_moves_all_landmarks_as_they_moved():
    alive = np.array([True, True])
    velocity = np.array([0.5, 0.0, 0.0, 0.0, -0.25, 0.0])
    way = np.outer(velocity, velocity)
    calm = jerk_cov(MODELS, 3, SharedNoise(np.zeros((6, 6)), np.zeros((6, 6))), alive)
    more = jerk_cov(MODELS, 3, SharedNoise(np.zeros((6, 6)), way), alive) - calm
    assert more[0, 0] > 0.0
    np.testing.assert_allclose(more, more[0, 0] * way / way[0, 0], atol=1e-9 * more[0, 0])
