"""What clocks learn from: the rows of the last motion, and for how long they count."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.monitors.epipolar_error import EpipolarErrors
from services.fusion.monitors.height_window import HeightWindow

FOCAL_PX = 527.0
NOISE = 0.1 / FOCAL_PX


def window() -> HeightWindow:
    return HeightWindow(NOISE, 1.0 / FOCAL_PX, 1e-4 * np.sqrt(0.1))


def errors(k: int, late_s: float, random, speed: float = 0.5) -> EpipolarErrors:
    """The k-th instant of six landmarks that swing, of clocks late_s apart, found at no shift."""
    moving = speed * np.sin(0.7 * k + np.arange(6))
    heights = late_s * moving + random.normal(0.0, NOISE, 6)
    return EpipolarErrors(
        np.arange(6),
        np.full(6, 0.1 * k),
        heights,
        moving,
        np.full(6, 0.067),
        np.full(6, NOISE**2),
    )


def test_a_shift_is_found_within_what_is_claimed():
    rows, random = window(), np.random.default_rng(1)
    for k in range(40):
        assert rows.add(errors(k, 0.003, random), 0.0, 0.005) == 6
    found = rows.fit(0.0)
    assert abs(found.shift_s - 0.003) < 3.0 * np.sqrt(found.variance)
    assert np.sqrt(found.variance) < 1e-4
    assert rows.instants == 40


def test_a_hand_that_rests_takes_no_moving_ones_place():
    rows, random = window(), np.random.default_rng(2)
    for k in range(40):
        rows.add(errors(k, 0.003, random), 0.0, 0.005)
    before = rows.fit(0.0)
    for k in range(40, 2000):
        rows.add(errors(k, 0.0, random, speed=0.0), 0.0, 0.005)
    assert rows.fit(0.0) == before
    assert rows.moved_s == pytest.approx(3.9)


def test_heights_that_no_clock_explains_are_left_out():
    rows, random = window(), np.random.default_rng(3)
    rows.add(errors(0, 0.003, random), 0.0, 0.005)
    heights = np.array([0.3, 0.3, 0.3, -0.3, np.nan, np.inf])
    wrong = errors(1, 0.003, random)._replace(heights=heights, speeds=np.full(6, 0.5))
    assert rows.add(wrong, 0.0, 0.005) == 0
    assert rows.instants == 2


def test_the_oldest_rows_make_room_for_new_ones():
    rows, random = window(), np.random.default_rng(5)
    for k in range(1000):
        rows.add(errors(k, 0.003 if k < 800 else -0.002, random), 0.0, 0.005)
    assert rows.instants == 150
    assert rows.fit(0.0).shift_s == pytest.approx(-0.002, abs=1e-4)


def test_little_noise_is_remembered_for_less_long_than_much():
    rows, random = window(), np.random.default_rng(4)
    for k in range(120):
        rows.add(errors(k, 0.0 if k < 60 else 0.003, random), 0.0, 0.005)
    quick = rows.fit(0.0)
    rows.adapt_memory(quick._replace(variance=1e-6))
    assert abs(rows.fit(0.0).shift_s - 0.003) > abs(quick.shift_s - 0.003)
    rows.keep(10)
    assert rows.fit(0.0).shift_s == pytest.approx(0.003, abs=3e-4)
