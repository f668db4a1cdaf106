"""Recordings are played smoothly: as they are, then to and fro; long gaps stay unknown."""

from __future__ import annotations

import numpy as np

from services.simulator.recorded_motion.playback import Curve, Playback


def test_a_recording_that_is_long_enough_is_played_as_it_is() -> None:
    times = np.linspace(-0.1, 2.3, 50)
    np.testing.assert_array_equal(Playback(2.0, False)(times), np.clip(times, 0.0, 2.0))


def test_a_short_one_goes_to_and_fro_without_a_jump_of_speed() -> None:
    span_s = 1.0
    times = np.arange(0.0, 7.0, 1e-3)
    shown = Playback(span_s, True)(times)
    assert shown.min() == 0.0
    assert shown.max() < span_s
    # As it is until its first turn.
    np.testing.assert_allclose(shown[:900], times[:900])
    np.testing.assert_allclose(shown[1200:1800], 2.0 * span_s - times[1200:1800])
    speed = np.diff(shown) * 1e3
    assert np.abs(speed).max() < 1.0 + 1e-6
    # A turn takes 0.2 s.
    assert np.abs(np.diff(speed)).max() < 1.1e-3 / 0.1


def test_a_curve_goes_through_its_samples_and_knows_where_it_knows_nothing() -> None:
    times = np.delete(np.arange(0.0, 1.0, 0.01), [*range(20, 25), *range(60, 75)])
    samples = np.stack([np.sin(5.0 * times), times**2], axis=1)
    samples[5] = np.nan
    curve = Curve(times, samples)
    seen = np.isfinite(samples[:, 0])
    np.testing.assert_allclose(curve(times[seen]), samples[seen], atol=1e-12)
    # Lost frames and short gaps are crossed.
    crossed = np.array([0.05, 0.22])
    np.testing.assert_allclose(curve(crossed)[:, 0], np.sin(5.0 * crossed), atol=1e-4)
    assert np.isnan(curve(np.array([-0.01, 0.65, 1.2]))).all()
