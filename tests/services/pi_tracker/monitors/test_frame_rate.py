"""The rate over some seconds, against the one in rig.toml."""

from __future__ import annotations

import pytest

from services.pi_tracker.monitors.frame_rate import FrameRate


def beats(rate, counts, now_ns=0):
    """One beat a second with so many frames before it; the states."""
    states = []
    for count in counts:
        for _ in range(count):
            rate.count()
        rate.beat(now_ns)
        now_ns += 10**9
        states.append(rate.slow)
    return states


def test_no_rate_before_some_seconds_have_passed():
    rate = FrameRate(30.0)
    beats(rate, [0, 30, 30, 30, 30])
    assert rate.rate_hz is None
    beats(rate, [30], 5 * 10**9)
    assert rate.rate_hz == pytest.approx(30.0)


def test_a_camera_that_has_just_begun_is_not_slow():
    assert not any(beats(FrameRate(30.0), [0] * 8 + [1] + [30] * 8))
    assert not any(beats(FrameRate(30.0), [1] + [30] * 8))


def test_one_lost_second_is_told_a_lost_frame_is_not():
    assert not any(beats(FrameRate(30.0), [0, 30, 29, 30, 28, 30, 30]))
    assert beats(FrameRate(30.0), [0, 30, 30, 30, 30, 0, 30, 30, 30, 30]) == (
        [False] * 5 + [True] * 4 + [False]
    )


def test_it_does_not_come_and_go_at_its_threshold():
    states = beats(FrameRate(30.0), [0, 30, 30, 30, 30] + [22, 25, 22, 25] * 5)
    assert states.index(True) > 0
    assert all(states[states.index(True) :])
