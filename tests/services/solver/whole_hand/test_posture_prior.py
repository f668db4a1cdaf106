"""Soft constraints as one Gaussian, hard ones as limits."""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.hand import HandModel, default_hand
from services.solver.whole_hand.posture_prior import clamp, habit


def _with_coupling(model: HandModel, ratio: float, weight: float) -> HandModel:
    digits = tuple(
        msgspec.structs.replace(digit, coupling=ratio, coupling_weight=weight)
        for digit in model.digits
    )
    return msgspec.structs.replace(model, digits=digits)


def test_the_habit_is_a_proper_gaussian() -> None:
    known = habit(default_hand())
    np.testing.assert_allclose(known.information @ known.covariance, np.eye(20), atol=1e-9)
    assert np.linalg.eigvalsh(known.covariance).min() > 0.0
    mean = np.rad2deg(known.mean.reshape(5, 4))
    assert np.all((mean[1:, 1:] > 15.0) & (mean[1:, 1:] < 60.0))
    np.testing.assert_allclose(mean[2, 0], 0.0, atol=1e-9)


def test_the_coupling_draws_by_its_weight() -> None:
    def spread(weight: float) -> float:
        row = np.zeros(20)
        row[7], row[6] = 1.0, -2.0 / 3.0
        return float(
            np.sqrt(row @ habit(_with_coupling(default_hand(), 2.0 / 3.0, weight)).covariance @ row)
        )

    assert spread(0.0) > np.deg2rad(25.0)
    assert spread(1.0) < np.deg2rad(5.1)
    assert spread(2.0) < np.deg2rad(2.6)


def test_three_bent_fingers_say_that_the_fourth_is_bent() -> None:
    """The Gaussian's own forecast of the index finger from the other fingers at 80 and 100 deg, and
    of MCP from PIP.
    """
    known = habit(default_hand())

    def forecast(wanted: list[int], given: list[int], values: list[float]) -> np.ndarray:
        gain = known.covariance[np.ix_(wanted, given)] @ np.linalg.inv(
            known.covariance[np.ix_(given, given)]
        )
        return np.rad2deg(known.mean[wanted] + gain @ (np.deg2rad(values) - known.mean[given]))

    mcp, pip = forecast([5, 6], [9, 10, 13, 14, 17, 18], [80.0, 100.0] * 3)
    assert 65.0 < mcp < 80.0
    assert 80.0 < pip < 100.0
    (alone,) = forecast([5], [6], [100.0])
    assert 45.0 < alone < mcp


def test_what_is_shared_is_a_projection() -> None:
    known = habit(default_hand())
    np.testing.assert_allclose(known.shares @ known.together, np.eye(2), atol=1e-12)
    shared = known.together @ known.shares
    np.testing.assert_allclose(shared @ known.covariance, (shared @ known.covariance).T, atol=1e-12)


def test_another_persons_ratio() -> None:
    mean = habit(_with_coupling(default_hand(), 1.0, 3.0)).mean.reshape(5, 4)
    np.testing.assert_allclose(mean[1:, 3], mean[1:, 2], atol=np.deg2rad(2.0))


def test_clamp_puts_everything_inside() -> None:
    limits = np.array([[-1.0, 1.0], [0.0, 0.0], [0.0, 2.0], [0.0, 1.0]])
    q = np.array([-5.0, 3.0, np.nan, np.inf])
    clamp(q, limits)
    np.testing.assert_array_equal(q, [-1.0, 0.0, 1.0, 0.5])
