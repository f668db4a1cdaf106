"""N frames of a closing, by interpolation in time."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.cycles.sample import interpolated, sampled
from studies.grasp.track import finger_track
from testing.synthetic_fingers import PEOPLE, Motion, recorded_person


def test_the_samples_are_the_finger_at_equal_steps_of_time():
    slow = finger_track(recorded_person(PEOPLE[0], Motion(cycles=1, fps=30.0)))
    quick = finger_track(recorded_person(PEOPLE[0], Motion(cycles=1, fps=1000.0)))
    made, truth = (sampled(one, 0.6, 2.4, 37) for one in (slow, quick))
    assert made.times_s == pytest.approx(np.linspace(0.6, 2.4, 37))
    assert np.rad2deg(np.abs(made.angles_rad - truth.angles_rad)).max() < 0.3
    assert np.abs(made.joints - truth.joints).max() < 0.2


def test_instants_in_a_gap_or_outside_stay_unmeasured():
    times = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    values = np.array([0.0, 1.0, 2.0, 10.0, 11.0])
    made = interpolated(np.array([0.15, 0.6, 1.05, 1.5]), times, values, 0.25)
    assert made[[0, 2]] == pytest.approx([1.5, 10.5])
    assert np.isnan(made[[1, 3]]).all()
    assert np.isnan(interpolated(times, times, np.full(5, np.nan), 1.0)).all()
