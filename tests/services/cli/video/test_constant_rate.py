"""Pictures at a constant rate: the nearest one at each instant, and no endless videos."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from services.cli.video.constant_rate import at_rate, rate_hz

MS = 1_000_000


def shown(stamps_ms, hz):
    return list(at_rate(((stamp * MS, stamp) for stamp in stamps_ms), hz))


def test_a_steady_camera_shows_every_picture_once():
    stamps = [round(1000 * k / 30) for k in range(90)]
    assert shown(stamps, 30.0) == stamps
    assert rate_hz("left", [stamp * MS for stamp in stamps]) == pytest.approx(30.303, abs=0.01)


def test_at_each_instant_the_nearest_picture_is_shown():
    rng = np.random.default_rng(1)
    stamps = np.cumsum(rng.choice([17, 33, 34, 50, 120], size=200)).tolist()
    hz = rate_hz("left", [stamp * MS for stamp in stamps])
    for k, found in enumerate(shown(stamps, hz)):
        instant = stamps[0] + 1000.0 * k / hz
        assert abs(found - instant) == pytest.approx(min(abs(s - instant) for s in stamps))
    # In real time: as long as the recording.
    assert (k + 1) / hz == pytest.approx(1e-3 * (stamps[-1] - stamps[0]), abs=2.0 / hz)


def test_a_pause_shows_the_last_picture():
    assert shown([0, 100, 200, 700, 800], 10.0) == [0, 100, 200, 200, 200, 700, 700, 700, 800]


def test_one_picture_and_none():
    assert shown([5], 1.0) == [5]
    assert shown([], 1.0) == []
    assert rate_hz("left", [5]) == 1.0


def test_slow_motion_is_shown_at_what_screens_show():
    stamps = [k * 1e9 / 240 for k in range(240)]
    assert rate_hz("left", stamps) == 60.0


def test_stamps_that_no_recording_has():
    stamps = [k * 33 * MS for k in range(30)]
    stamps[-1] += 3600 * 1000 * MS
    with pytest.raises(CaptureError, match=r"'left': 30 pictures lie 3601 s apart"):
        rate_hz("left", stamps)
