"""What cameras saw lately: the latest are kept, the oldest make room."""

from __future__ import annotations

import numpy as np

from services.fusion.intake.frame_rays import FrameRays, observation
from services.fusion.kalman.recent_observations import KEPT, no_observations, remember


def frame(time_s: float) -> FrameRays:
    """Landmark 1 seen by camera 0."""
    return FrameRays(
        0, np.array([1]), np.array([time_s]), np.array([[0.1, 0.2]]), np.full(1, 1e-4), 2e-4
    )


def test_the_latest_are_kept():
    recent = no_observations(2, 2)
    for k in range(KEPT + 3):
        remember(recent, frame(k / 30))
    np.testing.assert_allclose(np.sort(recent.time_s[1, 0]), np.arange(3, KEPT + 3) / 30)
    np.testing.assert_array_equal(recent.ray[1, 0], np.tile([0.1, 0.2], (KEPT, 1)))
    np.testing.assert_array_equal(recent.sigma[1, 0], 1e-4)
    assert recent.observed_s[1, 0] == (KEPT + 2) / 30
    assert recent.number.tolist() == [[0, 0], [KEPT + 3, 0]]


def test_a_late_one_does_not_turn_time_back():
    recent = no_observations(2, 2)
    for time_s in (0.5, 0.4):
        remember(recent, frame(time_s))
    assert recent.observed_s[1, 0] == 0.5
    assert np.isinf(recent.accepted_s).all()


def test_an_observation_has_the_variances_of_ray_and_clock():
    one = observation(frame(0.5), 0)
    assert (one.time_s, one.camera) == (0.5, 0)
    np.testing.assert_allclose([one.ray_variance, one.clock_variance], [1e-8, 4e-8])
