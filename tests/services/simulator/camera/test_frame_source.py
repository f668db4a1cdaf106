"""Frames as a tracker gets them."""

from __future__ import annotations

import numpy as np
import pytest

from services.simulator.camera.frame_source import FrameSource

START_NS = 1_700_000_000_000_000_000


@pytest.fixture(scope="module")
def live(fist) -> FrameSource:
    return FrameSource(fist, "left")


def test_a_frame_says_when_and_by_which_clock(live):
    taken = live.take(10, START_NS)
    assert (taken.camera, taken.seq, taken.size_px) == ("left", 10, (640, 480))
    assert taken.time_s == live.clock.time_s(10)
    true_ns = START_NS + round(taken.time_s * 1e9)
    # What remains beside the clock's skew is the driver's jitter.
    assert abs(taken.stamp_ns - taken.skew_ns - true_ns) < 120e3
    assert abs(taken.skew_ns) <= 21e6
    assert taken.image is not None
    np.testing.assert_array_equal(taken.image, live.renderer.picture(10))


def test_recorded_frames_have_almost_the_right_time(fist):
    source = FrameSource(fist, "right", recorded=True)
    taken = source.take(10, START_NS)
    assert abs(taken.skew_ns) <= 0.5e6
    assert abs(taken.stamp_ns - START_NS - taken.time_s * 1e9) < 0.65e6


def test_lost_frames_keep_their_number_and_have_no_picture(live):
    lost = next(k for k in range(1000) if live.clock.dropped(k))
    assert live.frame_time(lost).dropped
    taken = live.take(lost)
    assert taken.dropped
    assert taken.image is None
    assert taken.seq == lost
