"""Automatics that settle, and those that do not."""

from __future__ import annotations

import pytest

from rhot.files.calibration import Exposure
from services.pi_tracker.colors.settling import Settling

FRAME_NS = 33_333_333


def report(exposure_us=8000.0, gain=2.0, red=1.6, blue=1.4):
    return Exposure(exposure_us=exposure_us, gain=gain, red_gain=red, blue_gain=blue)


def test_automatics_settle_a_second_after_their_last_change():
    settling = Settling()
    settled_at = None
    for number in range(120):
        settling.add(
            report(
                exposure_us=max(8000.0, 20_000.0 - 400.0 * number), red=1.6 + 0.001 * (number % 3)
            ),
            number * FRAME_NS,
        )
        if settled_at is None and settling.settled() is not None:
            settled_at = number
    # 8000 us are reached in frame 30.
    assert 58 <= settled_at <= 62
    found = settling.settled()
    assert found.exposure_us == 8000.0
    assert found.red_gain == pytest.approx(1.601, abs=1e-3)


def test_automatics_that_hunt_never_settle():
    settling = Settling()
    for number in range(300):
        settling.add(report(gain=2.0 + 0.2 * (number // 10 % 2)), number * FRAME_NS)
        assert settling.settled() is None


def test_few_reports_are_not_enough():
    settling = Settling()
    assert settling.settled() is None
    for number in range(3):
        settling.add(report(), number * 600_000_000)
    assert settling.settled() is None
