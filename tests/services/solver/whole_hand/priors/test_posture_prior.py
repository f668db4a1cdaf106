"""Soft constraints as one Gaussian."""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.hand import HandModel, default_hand
from services.solver.whole_hand.priors.posture_prior import posture_prior


def _with_coupling(model: HandModel, ratio: float, weight: float) -> HandModel:
    digits = tuple(
        msgspec.structs.replace(digit, coupling=ratio, coupling_weight=weight)
        for digit in model.digits
    )
    return msgspec.structs.replace(model, digits=digits)


def test_the_habit_is_a_proper_gaussian() -> None:
    posture = posture_prior(default_hand())
    np.testing.assert_allclose(posture.information @ posture.covariance, np.eye(20), atol=1e-9)
    assert np.linalg.eigvalsh(posture.covariance).min() > 0.0
    mean = np.rad2deg(posture.mean.reshape(5, 4))
    assert np.all((mean[1:, 1:] > 15.0) & (mean[1:, 1:] < 60.0))
    np.testing.assert_allclose(mean[2, 0], 0.0, atol=1e-9)


def test_the_coupling_draws_by_its_weight() -> None:
    def spread(weight: float) -> float:
        row = np.zeros(20)
        row[7], row[6] = 1.0, -2.0 / 3.0
        model = _with_coupling(default_hand(), 2.0 / 3.0, weight)
        return float(np.sqrt(row @ posture_prior(model).covariance @ row))

    assert spread(0.0) > np.deg2rad(25.0)
    assert spread(1.0) < np.deg2rad(5.1)
    assert spread(2.0) < np.deg2rad(2.6)


def test_three_bent_fingers_say_that_the_fourth_is_bent() -> None:
    """The Gaussian's forecast of the index finger from the others, and of its MCP from its PIP."""
    posture = posture_prior(default_hand())

    def forecast(wanted: list[int], given: list[int], values: list[float]) -> np.ndarray:
        gain = posture.covariance[np.ix_(wanted, given)] @ np.linalg.inv(
            posture.covariance[np.ix_(given, given)]
        )
        return np.rad2deg(posture.mean[wanted] + gain @ (np.deg2rad(values) - posture.mean[given]))

    mcp, pip = forecast([5, 6], [9, 10, 13, 14, 17, 18], [80.0, 100.0] * 3)
    assert 65.0 < mcp < 80.0
    assert 80.0 < pip < 100.0
    (alone,) = forecast([5], [6], [100.0])
    assert 45.0 < alone < mcp


def test_what_is_shared_is_a_projection() -> None:
    posture = posture_prior(default_hand())
    np.testing.assert_allclose(posture.projection @ posture.synergies, np.eye(2), atol=1e-12)
    shared = posture.synergies @ posture.projection
    np.testing.assert_allclose(
        shared @ posture.covariance, (shared @ posture.covariance).T, atol=1e-12
    )


def test_another_persons_ratio() -> None:
    mean = posture_prior(_with_coupling(default_hand(), 1.0, 3.0)).mean.reshape(5, 4)
    np.testing.assert_allclose(mean[1:, 3], mean[1:, 2], atol=np.deg2rad(2.0))
