"""The last seconds of each camera's markers."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.alignment.height_memory import MEMORY_S, HeightMemory
from services.fusion.geometry.rectified_pair import rectified_pairs
from services.fusion.intake.observations import ObservationBuilder
from testing.synthetic_points import MovingHand, SyntheticRig, frames

RIG = SyntheticRig(clock_error_s=0.0, loss=0.0)
CAMERAS = RIG.rig()
VIEWS = [
    ObservationBuilder(RIG.config(), CAMERAS).build(frame)
    for frame in frames(RIG, MovingHand(), 8.0)
]


def remembered(views) -> HeightMemory:
    memory = HeightMemory(2)
    for view in views:
        memory.add(view)
    return memory


def test_it_holds_the_last_seconds_of_each_landmark():
    memory = remembered(VIEWS)
    assert memory.length_s(0) == pytest.approx(MEMORY_S, abs=0.05)
    first, second = memory.tracks(0, 1, rectified_pairs(tuple(CAMERAS.values()))[0, 1])
    assert len(first) == len(second) == 6
    for one, other in zip(first, second, strict=True):
        assert len(one.times_s) == pytest.approx(30 * MEMORY_S, abs=2)
        assert (np.diff(one.times_s) > 0.0).all()
        # One height, whatever the depth.
        there = np.interp(one.times_s[2:-2], other.times_s, other.heights)
        assert np.abs(one.heights[2:-2] - there).max() < 0.01


def test_a_clock_that_jumps_ends_what_was_before():
    late = [view._replace(instant_ns=view.instant_ns + 10**9) for view in VIEWS]
    memory = remembered([*VIEWS[:240], *late[240:300]])
    assert memory.length_s(0) == pytest.approx(1.0, abs=0.1)
    memory.clear(0)
    assert memory.newest_s(0) is None
    assert memory.length_s(0) == 0.0
    assert memory.length_s(1) > 0.9
