"""Smoothing: the same as Rauch-Tung-Striebel by dense matrices, for one model."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.hand_filter import MODELS
from services.fusion.kalman.motion.motion_models import (
    SharedNoise,
    add_walk,
    jerk_cov,
    turn_gram,
    unit_process_noise,
)
from services.fusion.kalman.motion.own_motion import add_own, own_noise, transitions
from testing.families.motions import flapping


def dense_transition(m: int, carried: np.ndarray, dt_s: float) -> np.ndarray:
    """F (54, 54) of six landmarks whose own motion is carried on (6,)."""
    F = np.zeros((54, 54))
    for k, (f01, f02, f11, f12, f21, f22) in enumerate(transitions(MODELS, m, carried, dt_s)):
        one = np.array([[1.0, f01, f02], [0.0, f11, f12], [0.0, f21, f22]])
        for r, c in np.ndindex(3, 3):
            for i in range(3):
                F[18 * r + 3 * k + i, 18 * c + 3 * k + i] = one[r, c]
    return F


def test_smoothed_as_rauch_tung_striebel(one_hand):
    """Test: an instant three frames back, of a hand that one model alone describes.

    Expected: the smoother's mean and covariance are those of RTS over the filtered estimates.
    """
    hand = one_hand()
    hand.run(range(20))
    history = hand.filter._history
    nodes = history.order[: history.size[0]]
    m = int(np.argmax(history.probability[nodes[-1]]))
    history.probability[nodes[-1]] = 0.0
    history.probability[nodes[-1], m] = 1.0
    assert (history.parent[nodes[1:], m] == m).all()
    mean, cov = history.state[nodes[-1], m, :54], history.cov[nodes[-1], m, :54, :54]
    for k in range(len(nodes) - 2, len(nodes) - 5, -1):
        dt_s = float(history.time_s[nodes[k + 1]] - history.time_s[nodes[k]])
        F = dense_transition(m, history.carried[nodes[k + 1], m], dt_s)
        x, P = history.state[nodes[k], m, :54], history.cov[nodes[k], m, :54, :54]
        Q = _noise(history, nodes[k], nodes[k + 1], m)
        predicted = F @ P @ F.T + Q
        G = np.linalg.solve(predicted, F @ P).T
        mean, cov = x + G @ (mean - F @ x), P + G @ (cov - predicted) @ G.T
    told = hand.told(float(history.time_s[nodes[-4]]))
    covs = told.covariances_m2
    assert told.found.all()
    np.testing.assert_allclose(told.positions_m.ravel(), mean[:18], atol=1e-6)
    for n in range(6):
        np.testing.assert_allclose(
            covs[n], cov[3 * n : 3 * n + 3, 3 * n : 3 * n + 3], atol=1e-2 * covs[n].max()
        )


def test_what_is_smoothed_just_before_a_look_has_a_variance(one_hand):
    """Test: a camera's frame is lost, and points are told within 2 ms before the next one.

    Expected: covariances are positive definite, though the look leaves next to nothing of 33 ms.
    """
    hand = one_hand(flapping(2.0, 40.0, seed=1))
    for begin in range(0, 120, 6):
        hand.run(range(begin, begin + 3))
        hand.run([begin + 4, begin + 5])
        for early_s in (0.0002, 0.001, 0.002):
            told = hand.told((begin + 4) / 60.0 - early_s)
            assert told.found.all()
            assert (np.linalg.eigvalsh(told.covariances_m2) > 0.0).all()


def _noise(history, last, node, m):
    """Q (54, 54) between two nodes."""
    gram, Q = np.empty((18, 18)), np.zeros((55, 55))
    likeliest = int(np.argmax(history.probability[last]))
    turn_gram(history.state[last, likeliest], history.alive[last], gram)
    dt_s = float(history.time_s[node] - history.time_s[last])
    shared = SharedNoise(gram, history.way[last])
    one_axis = np.empty((3, 3))
    rates = float(MODELS.velocity_rate[m]), float(MODELS.acceleration_rate[m])
    unit_process_noise(rates, dt_s, one_axis)
    Q[:54, :54] = np.kron(one_axis, jerk_cov(MODELS, m, shared, history.alive[last]))
    add_walk(MODELS, m, dt_s, history.alive[last], Q)
    by_itself = np.empty((2, 3, 3))
    own_noise(MODELS, m, dt_s, by_itself)
    for k, density in enumerate(history.own[node, m].tolist()):
        if density > 0.0:
            add_own(Q, k, density, by_itself[int(history.carried[node, m, k] > 0.0)])
    return Q[:54, :54]
