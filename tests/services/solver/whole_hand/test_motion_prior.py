"""The belief between looks: inverse, drift, forgetting."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import default_hand
from services.solver.whole_hand.motion_prior import predict, spd_inverse, unknown
from services.solver.whole_hand.posture_prior import habit


def _covariance(seed: int, n: int = 26) -> np.ndarray:
    A = np.random.default_rng(seed).normal(size=(n, n))
    return A @ A.T + 0.1 * np.eye(n)


@pytest.mark.parametrize("n", [1, 5, 26])
def test_inverse(n: int) -> None:
    A = _covariance(1, n)
    np.testing.assert_allclose(spd_inverse(A), np.linalg.inv(A), rtol=1e-9, atol=1e-9)


def test_no_time_changes_nothing() -> None:
    angles, P = np.full((5, 4), 0.3), 1e-3 * _covariance(2)
    expected, information = predict(habit(default_hand()), angles, P, 0.0)
    np.testing.assert_allclose(expected, angles, atol=1e-12)
    np.testing.assert_allclose(np.linalg.inv(information), P, rtol=1e-6, atol=1e-9)


def test_after_long_the_fingers_are_as_ever() -> None:
    known = habit(default_hand())
    expected, information = predict(known, np.full((5, 4), 1.2), 1e-4 * np.eye(26), 60.0)
    np.testing.assert_allclose(expected.ravel(), known.mean, atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.inv(information)[6:, 6:], known.covariance, rtol=1e-6, atol=1e-9
    )


def test_waiting_twice_is_waiting_once() -> None:
    known, angles, P = habit(default_hand()), np.full((5, 4), 0.9), 1e-3 * _covariance(3)
    once, information = predict(known, angles, P, 0.4)
    half, halfway = predict(known, angles, P, 0.2)
    twice, again = predict(known, half, np.linalg.inv(halfway), 0.2)
    np.testing.assert_allclose(twice, once, atol=1e-12)
    np.testing.assert_allclose(again, information, rtol=1e-6, atol=1e-6 * np.abs(information).max())


def test_before_the_first_look_the_wrist_may_be_anywhere() -> None:
    belief = unknown(habit(default_hand()))
    assert not belief.information[:6].any()
    assert np.linalg.eigvalsh(belief.information[6:, 6:]).min() > 0.0
