"""Smoothing: the same as Rauch-Tung-Striebel by dense matrices, for one model."""

from __future__ import annotations

import numpy as np

from services.fusion.joint.hand_filter import MODELS
from services.fusion.joint.motion_models import add_noise, transition, turn_gram


def dense_transition(rate: float, dt_s: float, axes: int) -> np.ndarray:
    F = transition(rate, dt_s)
    one = np.array([[1.0, F.f01, F.f02], [0.0, F.f11, F.f12], [0.0, F.f21, F.f22]])
    return np.kron(one, np.eye(axes))


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
        F = dense_transition(
            float(MODELS.rate[m]),
            float(history.time_s[nodes[k + 1]] - history.time_s[nodes[k]]),
            18,
        )
        x, P = history.state[nodes[k], m, :54], history.cov[nodes[k], m, :54, :54]
        Q = _noise(history, nodes[k], nodes[k + 1], m)
        predicted = F @ P @ F.T + Q
        G = np.linalg.solve(predicted, F @ P).T
        mean, cov = x + G @ (mean - F @ x), P + G @ (cov - predicted) @ G.T
    found, places, covs = hand.filter.estimate(float(history.time_s[nodes[-4]]))
    assert found.all()
    np.testing.assert_allclose(places.ravel(), mean[:18], atol=1e-6)
    for n in range(6):
        np.testing.assert_allclose(
            covs[n], cov[3 * n : 3 * n + 3, 3 * n : 3 * n + 3], atol=1e-2 * covs[n].max()
        )


def _noise(history, last, node, m):
    """Q (54, 54) between two nodes."""
    gram, Q = np.empty((18, 18)), np.zeros((55, 55))
    likeliest = int(np.argmax(history.probability[last]))
    turn_gram(history.state[last, likeliest], history.alive[last], gram)
    dt_s = float(history.time_s[node] - history.time_s[last])
    add_noise(MODELS, m, dt_s, gram, history.alive[last], Q)
    return Q[:54, :54]
