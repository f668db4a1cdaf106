"""What is told of markers that may be something else."""

from __future__ import annotations

import pytest

from services.pi_tracker.measure.centroid import Centroid
from services.pi_tracker.measure.occluded_marker import doubts_px, marker_of

WHOLE = 150.0


@pytest.mark.parametrize("area_px2", [30.0, 750.0])
def test_a_marker_of_another_size_that_is_elsewhere_than_the_hand_says_is_in_doubt(area_px2):
    """A fifth of it, or five times as much, 25 px from where it was predicted."""
    doubts = doubts_px([1.0, 2.0, 25.0], [150.0, 150.0, area_px2], [WHOLE] * 3)
    assert doubts[:2] == [0.0, 0.0]
    assert doubts[2] == pytest.approx(0.8 * 18.0)


def test_neither_size_nor_place_alone_is_in_doubt():
    assert doubts_px([1.0, 2.0, 25.0], [WHOLE] * 3, [WHOLE] * 3) == [0.0] * 3
    assert doubts_px([1.0, 2.0, 3.0], [150.0, 150.0, 30.0], [WHOLE] * 3) == [0.0] * 3
    # A hand that stops: all are elsewhere.
    assert doubts_px([20.0, 25.0, 25.0], [150.0, 150.0, 30.0], [WHOLE] * 3) == [0.0] * 3
    assert doubts_px([], [], []) == []


def test_doubt_widens_sigma():
    centroid = Centroid(x_px=100.0, y_px=50.0, area_px=30.0, sigma_px=0.3, quality=0.9)
    sure, unsure = (marker_of("blue", centroid, 1.0, 0.0, doubt) for doubt in (0.0, 4.0))
    assert (sure.sigma_px, unsure.sigma_px) == pytest.approx((0.3, 4.0112), abs=1e-4)
    assert sure.x_px == unsure.x_px
    covered = marker_of("blue", centroid, 1.0, 0.8, 0.0)
    assert covered.sigma_px > 3.0
    assert covered.quality < 0.2
