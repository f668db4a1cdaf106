"""How fast and how far distances change, learnt from what two cameras see."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.one_camera.distance_motion import (
    DistanceMotion,
    learn_motion,
    moved_sigma_m,
    no_motion,
)

SPAN_S = 1.0 / 30.0
EYE = np.zeros(3)


def seen(distances_m, begin_s: float = 0.0, motion: DistanceMotion | None = None) -> DistanceMotion:
    """The first of two landmarks straight ahead, a frame at a time."""
    motion = no_motion(2) if motion is None else motion
    located = np.array([True, False])
    for k, distance_m in enumerate(distances_m):
        places = np.array([[0.0, 0.0, distance_m], [0.0, 0.0, 9.0]])
        learn_motion(motion, located, places, EYE, begin_s + k * SPAN_S, SPAN_S)
    return motion


def swing(amplitude_m: float, seconds: float = 8.0):
    return 0.6 + amplitude_m * np.sin(5.0 * np.arange(0.0, seconds, SPAN_S))


def test_speed_and_range_are_those_of_the_motion():
    motion = seen(swing(0.05))
    assert np.sqrt(motion.squared_speed[0]) == pytest.approx(0.05 * 5.0 / np.sqrt(2.0), rel=0.25)
    assert np.sqrt(motion.variance_m2[0]) == pytest.approx(0.05 / np.sqrt(2.0), rel=0.25)
    assert motion.time_s[1] == -np.inf


def test_it_grows_with_time_up_to_the_range():
    motion = seen(swing(0.05))
    grown = [moved_sigma_m(motion, 0, age_s) for age_s in (0.05, 0.1, 0.5, 5.0)]
    assert grown[0] == pytest.approx(0.5 * grown[1])
    assert grown[1] < grown[2] == grown[3] == pytest.approx(0.07, rel=0.3)


def test_it_covers_the_other_end_of_a_way():
    distances_m = swing(0.12)
    half_s = np.pi / 5.0
    apart_m = distances_m[round(half_s / SPAN_S) :] - distances_m[: -round(half_s / SPAN_S)]
    sigma_m = moved_sigma_m(seen(distances_m), 0, half_s)
    assert sigma_m == pytest.approx(np.sqrt(np.mean(apart_m**2)), rel=0.2)


def test_a_resting_hand_may_set_off_and_a_fast_one_is_not_lost():
    resting, fast = seen(np.full(240, 0.6)), seen(swing(0.3))
    assert 0.0 < moved_sigma_m(resting, 0, 0.1) < 0.01
    assert moved_sigma_m(resting, 0, 1.0) == pytest.approx(0.02)
    assert moved_sigma_m(fast, 0, 1.0) == pytest.approx(0.3)


def test_a_gap_is_no_motion():
    motion = seen(np.full(240, 0.6))
    moved = seen(np.full(5, 0.9), begin_s=20.0, motion=motion)
    assert np.sqrt(moved.squared_speed[0]) < 0.01
    assert moved.mean_m[0] == pytest.approx(0.9)
