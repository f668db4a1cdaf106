"""How far apart frames come, of cameras that are as told, slow, or lose some."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.intake.frame_pace import FramePace

FRAME_NS = 1_000_000_000 // 30


def paced(instants_ns) -> FramePace:
    """After frames of the second of two cameras that are told as 30 a second."""
    pace = FramePace(np.full(2, 1 / 30))
    for instant_ns in instants_ns:
        pace.note(1, int(instant_ns))
    return pace


def test_frames_as_told_change_nothing():
    random = np.random.default_rng(1)
    pace = paced(np.arange(300) * FRAME_NS + random.normal(0.0, 1e6, 300))
    assert pace.periods_s == pytest.approx([1 / 30] * 2, rel=0.03)
    assert pace.shortest_s == pytest.approx([1 / 30] * 2)


def test_a_slow_camera_is_known_within_two_seconds():
    pace = paced(np.arange(20) * 3 * FRAME_NS)
    assert pace.periods_s == pytest.approx([1 / 30, 0.1], rel=0.15)
    assert pace.shortest_s == pytest.approx([1 / 30, 0.1], rel=0.15)
    assert paced(np.arange(60) * 3 * FRAME_NS).shortest_s[1] == pytest.approx(0.1, rel=0.01)


def test_lost_frames_are_told_from_slow_ones():
    kept = np.flatnonzero(np.random.default_rng(2).random(400) < 0.4)
    pace = paced(kept * FRAME_NS)
    assert 0.05 < pace.periods_s[1] < 0.13
    assert pace.shortest_s[1] < 0.06


def test_a_pause_and_frames_that_come_late_say_nothing():
    told = paced(np.arange(10) * FRAME_NS).periods_s[1]
    late = [9 * FRAME_NS, 3 * FRAME_NS, 40 * FRAME_NS, 41 * FRAME_NS]
    assert paced([*(np.arange(10) * FRAME_NS), *late]).periods_s[1] == pytest.approx(told, rel=1e-3)


def test_time_that_starts_anew_is_no_interval():
    pace = paced(np.arange(60) * 3 * FRAME_NS)
    slow_s = float(pace.periods_s[1])
    pace.forget()
    pace.note(1, 10**18)
    assert pace.periods_s[1] == slow_s
    pace.note(1, 10**18 + FRAME_NS)
    assert pace.periods_s[1] < slow_s
