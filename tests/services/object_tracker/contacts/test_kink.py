"""The instant at which a line stops falling or begins to rise."""

from __future__ import annotations

import numpy as np
import pytest

from services.object_tracker.contacts.kink import arrival, departure

TIMES = np.arange(-0.4, 0.001, 1 / 30)


@pytest.mark.parametrize("kink_s", [-0.21, -0.15, -0.088])
@pytest.mark.parametrize("level_m", [-0.002, 0.0, 0.003])
def test_an_arrival_is_found_between_samples_whatever_the_level(kink_s, level_m):
    values = level_m + 0.12 * np.maximum(0.0, kink_s - TIMES)
    found = arrival(TIMES, values)
    # What is 0.6 mm from where it rests touches.
    assert found.time_s == pytest.approx(kink_s - 0.0006 / 0.12, abs=0.006)
    assert found.level_m == pytest.approx(level_m, abs=3e-4)
    assert found.rise_m == pytest.approx(0.12 * (kink_s - TIMES[0]), rel=0.05)


def test_a_finger_that_slows_down_into_a_touch_is_dated_by_its_last_millimetre():
    values = 0.4 * np.maximum(0.0, -0.12 - TIMES) ** 2
    begin_s = -0.12 - (0.0006 / 0.4) ** 0.5
    assert arrival(TIMES, values).time_s == pytest.approx(begin_s, abs=0.006)


def test_a_departure_is_the_mirrored_arrival():
    values = -0.001 + 0.09 * np.maximum(0.0, TIMES + 0.1)
    assert departure(TIMES, values).time_s == pytest.approx(-0.1 + 0.0005 / 0.09, abs=0.005)


def test_a_finger_that_set_out_only_just_before_is_dated_by_where_it_stops():
    values = np.clip(0.15 * (-0.1 - TIMES), 0.0, 0.015)
    assert arrival(TIMES, values).time_s == pytest.approx(-0.1, abs=0.01)


def test_noise_moves_the_kink_little():
    rng = np.random.default_rng(0)
    clean = 0.1 * np.maximum(0.0, -0.12 - TIMES)
    found = [arrival(TIMES, clean + rng.normal(0.0, 5e-4, len(TIMES))).time_s for _ in range(200)]
    assert np.median(np.abs(np.array(found) + 0.12)) < 0.012


def test_what_does_not_move_that_way_has_no_kink():
    assert departure(TIMES, -0.1 * TIMES) is None
    assert departure(TIMES, np.full(len(TIMES), 0.001)) is None
    assert departure(TIMES[:3], 0.1 * TIMES[:3]) is None
