"""The prior between measurements: drift and relaxation."""

from __future__ import annotations

import numpy as np

from rhot.hand import default_hand
from services.solver.whole_hand.priors.motion_prior import predict, uninformed_prior
from services.solver.whole_hand.priors.posture_prior import posture_prior


def _covariance(seed: int) -> np.ndarray:
    A = np.random.default_rng(seed).normal(size=(26, 26))
    return A @ A.T + 0.1 * np.eye(26)


def test_no_time_changes_nothing() -> None:
    angles, P = np.full((5, 4), 0.3), 1e-3 * _covariance(2)
    expected, information = predict(posture_prior(default_hand()), angles, P, 0.0)
    np.testing.assert_allclose(expected, angles, atol=1e-12)
    np.testing.assert_allclose(np.linalg.inv(information), P, rtol=1e-6, atol=1e-9)


def test_after_long_the_fingers_are_as_ever() -> None:
    posture = posture_prior(default_hand())
    expected, information = predict(posture, np.full((5, 4), 1.2), 1e-4 * np.eye(26), 60.0)
    np.testing.assert_allclose(expected.ravel(), posture.mean, atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.inv(information)[6:, 6:], posture.covariance, rtol=1e-6, atol=1e-9
    )


def test_waiting_twice_is_waiting_once() -> None:
    posture, angles, P = posture_prior(default_hand()), np.full((5, 4), 0.9), 1e-3 * _covariance(3)
    once, information = predict(posture, angles, P, 0.4)
    half, halfway = predict(posture, angles, P, 0.2)
    twice, again = predict(posture, half, np.linalg.inv(halfway), 0.2)
    np.testing.assert_allclose(twice, once, atol=1e-12)
    np.testing.assert_allclose(again, information, rtol=1e-6, atol=1e-6 * np.abs(information).max())


def test_before_the_first_measurement_the_wrist_may_be_anywhere() -> None:
    prior = uninformed_prior(posture_prior(default_hand()))
    assert not prior.information[:6].any()
    assert np.linalg.eigvalsh(prior.information[6:, 6:]).min() > 0.0
