"""Clocks that are set while fusion runs, and nobody says so."""

from __future__ import annotations

import pytest

from services.fusion.step import FusionStep
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames, point_hands
from testing.wrong_markers import with_clock_error


@pytest.mark.parametrize("late_s", [0.02, 0.137, -0.2])
def test_a_clock_that_is_set_behind_everybodys_back_is_put_right_within_seconds(late_s):
    """By then all was well for so long that next to nothing is searched for."""
    setup = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4)
    given_frames = frames(setup, MovingHand(), 24.0)
    late = with_clock_error(given_frames, "right", late_s)
    half = len(given_frames) // 2
    step = FusionStep(setup.config(), setup.rig(), point_hands())
    off_s = {}
    for frame in [*given_frames[:half], *late[half:]]:
        if frame is late[half]:
            searches = step.alignment.searches
        step.step(frame)
        step.settle()
        known = step.alignment.corrections.get("right")
        learned_s = step.clocks.late_s["right"] - step.clocks.late_s["left"]
        time_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
        off_s[time_s] = learned_s + (known.late_s if known else 0.0) - late_s
    assert searches <= 3
    assert max(abs(off) for time_s, off in off_s.items() if time_s > 20.0) < 1e-3
