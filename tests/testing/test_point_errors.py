"""Errors of points: against the truth at their own instants."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import BASIC_LANDMARKS
from rhot.messages import HandPoint, HandPoints
from testing.point_errors import point_errors, share_within, squared_distances
from testing.synthetic_points import START_NS, MovingHand


def message(at_s: float, offset_m: float, source: str) -> HandPoints:
    """All points of a moving hand, off by so much along z."""
    points = [
        HandPoint(
            name=name,
            position_m=tuple(np.add(place, [0.0, 0.0, offset_m]).tolist()),
            sigma_m=(1e-3, 1e-3, 2e-3),
            cameras=["left", "right"],
            source=source,
        )
        for name, place in zip(BASIC_LANDMARKS, MovingHand()(np.array([at_s]))[0], strict=True)
    ]
    return HandPoints(hand="right", seq=0, stamp_ns=START_NS + round(at_s * 1e9), points=points)


def test_errors_are_those_of_every_point_at_its_own_instant():
    found = point_errors(
        [message(0.5, 3e-3, "measured"), message(1.5, -4e-3, "predicted")], MovingHand()
    )
    np.testing.assert_allclose(found.errors_m[:, :2], 0.0, atol=1e-9)
    assert found.measured.tolist() == [True] * 6 + [False] * 6
    assert found.rms_mm == pytest.approx(np.sqrt(12.5))
    assert found.depth_rms_mm == pytest.approx(np.sqrt(12.5))
    assert found.nees == pytest.approx(12.5 / 4.0 / 3.0)
    early = found.within(0.0, 1.0)
    assert early.rms_mm == pytest.approx(3.0)
    assert len(found.within(1.0).instants_s) == 6


def test_three_sigmas_of_the_whole_covariance_hold_997_of_a_thousand():
    rng = np.random.default_rng(1)
    spread = rng.normal(0.0, 1e-3, (3, 3))
    errors = rng.normal(0.0, 1.0, (100_000, 3)) @ spread.T
    covariances = np.broadcast_to(spread @ spread.T, (len(errors), 3, 3))
    assert share_within(squared_distances(errors, covariances)) == pytest.approx(99.7, abs=0.06)
    # Sigmas that are a third too small do not, whatever their axes.
    assert share_within(squared_distances(errors, covariances / 1.5**2)) < 98.0
    assert np.isnan(share_within(np.empty(0)))
