"""What clocks learn from: the rows of the last motion, and for how long they count."""

from __future__ import annotations

import math

import numpy as np
import pytest

from services.fusion.monitors.epipolar_error import EpipolarError
from services.fusion.monitors.height_window import HeightWindow

FOCAL_PX = 527.0
NOISE = 0.1 / FOCAL_PX


def window() -> HeightWindow:
    return HeightWindow(NOISE, 1.0 / FOCAL_PX, 1e-4 * np.sqrt(0.1))


def errors(k: int, late_s: float, random, speed: float = 0.5) -> dict[int, EpipolarError]:
    """The k-th instant of six landmarks that swing, of clocks late_s apart, found at no shift."""
    found = {}
    for landmark in range(6):
        moving = speed * float(np.sin(0.7 * k + landmark))
        height = late_s * moving + random.normal(0.0, NOISE)
        found[landmark] = EpipolarError(0.1 * k, height, moving, 0.067, NOISE**2)
    return found


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
    wrong = {row: EpipolarError(0.1, 0.3, 0.5, 0.067, 1e-8) for row in range(6)}
    wrong[5] = EpipolarError(0.1, math.inf, 0.5, 0.067, 1e-8)
    assert rows.add(wrong, 0.0, 0.005) == 0


def test_little_noise_is_remembered_for_less_long_than_much():
    rows, random = window(), np.random.default_rng(4)
    for k in range(120):
        rows.add(errors(k, 0.0 if k < 60 else 0.003, random), 0.0, 0.005)
    quick = rows.fit(0.0)
    rows.adapt_memory(quick._replace(variance=1e-6))
    assert abs(rows.fit(0.0).shift_s - 0.003) > abs(quick.shift_s - 0.003)
    rows.keep(10)
    assert rows.fit(0.0).shift_s == pytest.approx(0.003, abs=3e-4)
