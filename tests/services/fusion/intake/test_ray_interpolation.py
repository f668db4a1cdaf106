"""Bringing views to one instant."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.fusion.intake.ray_interpolation import SAMPLES, RayTrack, polynomial_weights

PERIOD_S = 1.0 / 30.0
coefficient = st.floats(-5.0, 5.0)


def track_of(function, times_s, sigma=1e-4) -> RayTrack:
    track = RayTrack()
    for time_s in times_s:
        track.add(time_s, np.array([function(time_s), -function(time_s)]), sigma)
    return track


@settings(deadline=None)  # the first example compiles
@given(
    st.tuples(coefficient, coefficient, coefficient, coefficient),
    st.floats(0.0, 1.0),
    st.floats(-0.3, 0.3),
)
def test_hermite_is_exact_on_cubics(c, share, jitter):
    def cubic(t):
        return c[0] + c[1] * t + c[2] * t**2 + c[3] * t**3

    times = PERIOD_S * np.array([0.0, 1.0 + jitter, 2.0, 3.0 - jitter])
    at = times[1] + share * (times[2] - times[1])
    found = track_of(cubic, times).at(at, "hermite", PERIOD_S)
    assert found is not None
    assert found.ray[0] == pytest.approx(cubic(at), abs=1e-9)


def test_linear_is_exact_on_lines_and_nearest_takes_the_nearest():
    track = track_of(lambda t: 2.0 * t, [0.0, PERIOD_S, 2 * PERIOD_S])
    linear = track.at(1.25 * PERIOD_S, "linear", PERIOD_S)
    nearest = track.at(1.25 * PERIOD_S, "nearest", PERIOD_S)
    assert linear.ray[0] == pytest.approx(2.5 * PERIOD_S)
    assert nearest.ray[0] == pytest.approx(2.0 * PERIOD_S)
    # It moved by about a quarter of a frame's way, sqrt(2) as both coordinates move.
    assert nearest.sigma == pytest.approx(np.sqrt(2.0) * 0.5 * PERIOD_S, rel=1e-3)


def test_noise_passes_as_the_weights_say():
    weights = polynomial_weights(np.array([-1.5, -0.5, 0.5, 1.5]), 0.0)
    np.testing.assert_allclose(weights, np.array([-1.0, 9.0, 9.0, -1.0]) / 16.0, atol=1e-12)
    track = track_of(np.zeros_like, PERIOD_S * np.arange(4), sigma=1.0)
    assert track.at(1.5 * PERIOD_S, "hermite", PERIOD_S).sigma == pytest.approx(
        np.linalg.norm(weights)
    )


def test_the_bend_is_what_two_parabolas_differ_by():
    times, at = PERIOD_S * np.array([0.0, 1.0, 2.1, 3.0]), 1.4 * PERIOD_S
    heights = np.array([0.0, 0.1, 0.3, 0.2])
    first, last = (
        polynomial_weights(times[part], at) @ heights[part] for part in (slice(3), slice(1, 4))
    )
    track = track_of(lambda t: np.interp(t, times, heights), times)
    bend = track.at(at, "hermite", PERIOD_S).bend
    np.testing.assert_allclose(bend, [last - first, first - last], rtol=1e-9)
    straight = track_of(lambda t: 1.0 + 2.0 * t - t**2, times)
    np.testing.assert_allclose(straight.at(at, "hermite", PERIOD_S).bend, 0.0, atol=1e-12)
    assert not track.at(0.5 * PERIOD_S, "hermite", PERIOD_S).bend.any()


def test_waits_for_what_it_needs_and_says_when_it_has_less():
    track = track_of(lambda t: t, [0.0, PERIOD_S])
    assert track.at(1.5 * PERIOD_S, "linear", PERIOD_S) is None
    assert track.at(-0.1, "hermite", PERIOD_S) is None
    assert track.at(0.5 * PERIOD_S, "hermite", PERIOD_S).samples == 2
    track.add(2 * PERIOD_S, np.zeros(2), 1e-4)
    assert track.at(0.5 * PERIOD_S, "hermite", PERIOD_S).samples == 3
    assert RayTrack().at(0.0, "nearest", PERIOD_S) is None
    assert track.at(4 * PERIOD_S, "nearest", PERIOD_S) is None


def test_no_bridge_over_a_gap():
    track = track_of(lambda t: t, [0.0, PERIOD_S, 6 * PERIOD_S, 7 * PERIOD_S])
    assert track.at(3 * PERIOD_S, "hermite", PERIOD_S) is None
    assert track.at(3 * PERIOD_S, "linear", PERIOD_S) is None


def test_order_does_not_matter_twice_does_not_count_and_memory_is_bounded():
    times = PERIOD_S * np.arange(6)
    shuffled = track_of(np.sin, times[[3, 0, 5, 1, 4, 2, 2, 3]])
    ordered = track_of(np.sin, times)
    for at in np.linspace(times[0], 0.99 * times[-1], 20):
        np.testing.assert_array_equal(
            shuffled.at(at, "hermite", PERIOD_S).ray, ordered.at(at, "hermite", PERIOD_S).ray
        )
    long = track_of(np.sin, PERIOD_S * np.arange(1000))
    assert long.count == SAMPLES
    np.testing.assert_array_equal(long.samples.times_s, PERIOD_S * np.arange(1000)[-SAMPLES:])
    long.add(0.0, np.zeros(2), 1.0)
    assert long.count == SAMPLES
