"""Closings and openings: found in noise, with pauses, given up half way, begun before the film."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from studies.grasp.cycles.find import find_cycles
from testing.synthetic_fingers import PEOPLE, Motion, person_angles, smooth_step


def flexion(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    times, angles = person_angles(PEOPLE[0], motion)
    return times, angles.sum(axis=1)


def curve(*corners: tuple[float, float], fps: float = 30.0) -> tuple[np.ndarray, np.ndarray]:
    """Smooth from corner (s, deg) to corner, in rad."""
    times = np.arange(corners[0][0], corners[-1][0], 1.0 / fps)
    values = np.zeros(len(times))
    for (a, before), (b, after) in pairwise(corners):
        inside = times >= a
        values[inside] = before + (after - before) * smooth_step((times[inside] - a) / (b - a))
    return times, np.deg2rad(values)


def closings(times, values):
    found, why = find_cycles(times, values)
    assert why == ""
    return [cycle for cycle in found if cycle.kind == "closing"]


@pytest.mark.parametrize("noise_deg", [0.0, 2.0, 5.0])
def test_each_closing_and_opening_is_found_once(noise_deg):
    times, values = flexion(Motion(cycles=5, fps=30.0))
    noise = np.random.default_rng(3).normal(0.0, np.deg2rad(noise_deg), len(values))
    found, _ = find_cycles(times, values + noise)
    assert [cycle.kind for cycle in found] == ["closing", "opening"] * 5
    assert not [cycle.incomplete for cycle in found if cycle.incomplete]
    clean, _ = find_cycles(times, values)
    for one, other in zip(found, clean, strict=True):
        # Where a smooth motion begins, a degree is 50 ms.
        assert one.start_s == pytest.approx(other.start_s, abs=0.25)
        assert one.end_s == pytest.approx(other.end_s, abs=0.25)


def test_outliers_and_missing_frames_make_no_closing():
    times, values = flexion(Motion(cycles=3, fps=30.0))
    values[[40, 95, 200]] += 2.0
    values[::7] = np.nan
    assert len(closings(times, values)) == 3


def test_a_pause_on_the_way_stays_in_the_closing_and_is_told():
    found = closings(*curve((0, 5), (0.5, 5), (1.3, 120), (2.5, 120), (3.3, 240), (4, 240)))
    assert len(found) == 1
    assert found[0].pause_s == pytest.approx(1.3, abs=0.3)
    assert found[0].end_s - found[0].start_s > 2.0


def test_a_closing_given_up_half_way_is_incomplete():
    corners = [(0, 5), (1, 5), (2, 240), (3, 5), (4, 130), (5, 5), (6, 240), (7, 5), (8, 5)]
    found = closings(*curve(*corners))
    assert [bool(cycle.incomplete) for cycle in found] == [False, True, False]
    assert "of the usual range" in found[1].incomplete


def test_a_film_that_starts_and_ends_in_a_closing():
    times, values = curve((0, 5), (1, 240), (2, 5), (3, 240), (4, 5), (5, 240))
    kept = (times > 0.4) & (times < 4.6)
    found = closings(times[kept], values[kept])
    assert [bool(cycle.incomplete) for cycle in found] == [True, False, True]
    assert "starts in the middle" in found[0].incomplete
    assert "ends in the middle" in found[2].incomplete


def test_a_single_closing_without_rest_as_the_paper_cuts_it():
    found = closings(*curve((0, 5), (2, 240), fps=18.0))
    assert len(found) == 1
    assert not found[0].incomplete


def test_nothing_measured_for_a_while_makes_it_incomplete():
    times, values = curve((0, 5), (1, 5), (3, 240), (4, 240))
    values[(times > 1.8) & (times < 2.3)] = np.nan
    found = closings(times, values)
    assert "nothing was measured" in found[0].incomplete


def test_why_there_are_none():
    times = np.arange(0, 3, 0.03)
    found, why = find_cycles(times, np.deg2rad(10 + 3 * np.sin(times)))
    assert found == []
    assert "change by" in why
    found, why = find_cycles(times, np.full(len(times), np.nan))
    assert found == []
    assert "0 frames" in why
