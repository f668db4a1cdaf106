"""What a filter does to a recording: its own path, the reference, jitter, error and lag."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.paired.filter_quality import (
    jitter_m,
    lag_s,
    motion_error_m,
    motion_speed_m_s,
    one_euro_path,
    reference_path,
)
from services.fusion.paired.one_euro import OneEuroFilter
from services.fusion.paired.recorded_tracks import Track, tracks
from testing.synthetic_points import MovingHand


def moving(times_s) -> Track:
    """A path without noise, all of it fast."""
    nothing, everything = np.zeros(len(times_s), dtype=bool), np.ones(len(times_s), dtype=bool)
    return Track(times_s, MovingHand()(times_s)[:, 2], nothing, everything)


def test_it_is_the_live_filter(recording):
    track = tracks(recording(3.0, 3.0))[0]
    live = OneEuroFilter(1.2, 170.0, 1.0, joint=True)
    steps = [0.0, *np.diff(track.times_s).tolist()]
    expected = np.array([live(point, dt) for point, dt in zip(track.points_m, steps, strict=True)])
    np.testing.assert_allclose(one_euro_path(track, 1.2, 170.0), expected, atol=1e-12)


def test_the_reference_has_no_lag_and_survives_gaps():
    track = moving(np.delete(np.arange(0.0, 4.0, 1.0 / 30.0), slice(40, 60)))
    reference = reference_path(track)
    assert 1e3 * np.sqrt(np.mean(np.sum((reference - track.points_m) ** 2, axis=1))) < 0.3


def test_jitter_is_noise_without_drift():
    """Test: a hand that drifts by 2 cm/s with noise of 1 mm on each axis. Expected: 1 mm."""
    times_s = np.arange(0.0, 6.0, 1.0 / 30.0)
    noise = np.random.default_rng(0).normal(0.0, 1e-3, (len(times_s), 3))
    points_m = np.outer(times_s, [0.02, 0.0, 0.0]) + noise
    still = np.ones(len(times_s), dtype=bool)
    track = Track(times_s, points_m, still, ~still)
    assert jitter_m([track], [points_m]) == pytest.approx(1e-3, rel=0.1)
    assert jitter_m([track], [0.0 * points_m]) == pytest.approx(1e-7)


def test_lag_and_error_are_those_of_a_delayed_path():
    track = moving(np.arange(0.0, 4.0, 1.0 / 120.0))
    delayed = MovingHand()(track.times_s - 0.03)[:, 2]
    references = [track.points_m]
    assert lag_s([track], [delayed], references) == pytest.approx(0.03, abs=0.002)
    speed_m_s = motion_speed_m_s([track], references)
    assert speed_m_s == pytest.approx(0.5, rel=0.3)
    # The path curves: a little less than the way it goes within the delay.
    error_m = motion_error_m([track], [delayed], references)
    assert error_m == pytest.approx(speed_m_s * 0.03, rel=0.1)
