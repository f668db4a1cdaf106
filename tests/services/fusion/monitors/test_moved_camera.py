"""A bumped camera: reported when it shows for long, taken back when the views fit again."""

from __future__ import annotations

import pytest

from services.fusion.monitors.moved_camera import MOVED_PX, MovedCameraMonitor


def observed(monitor: MovedCameraMonitor, heights_px) -> float | None:
    for height_px in heights_px:
        monitor.observe(0, height_px)
    return monitor.height_px(0)


def test_heights_that_differ_for_seconds_are_reported_with_their_size():
    monitor = MovedCameraMonitor(2)
    assert observed(monitor, [4.0] * 40) is None
    assert observed(monitor, [4.0] * 40) == pytest.approx(4.0)
    assert monitor.height_px(1) is None


def test_a_wrong_marker_now_and_then_is_not():
    monitor = MovedCameraMonitor(1)
    for _ in range(200):
        assert observed(monitor, [0.2, 0.3, 50.0, 0.1, 0.2]) is None


def test_it_is_taken_back_when_most_heights_fit_again():
    monitor = MovedCameraMonitor(1)
    assert observed(monitor, [2.0 * MOVED_PX] * 100) is not None
    # A third that do not fit would not be reported, but what is reported stays.
    assert observed(monitor, [2.0 * MOVED_PX, 0.1, 0.1] * 200) is not None
    assert observed(monitor, [0.1] * 100) is None


def test_an_infinite_height_counts_as_one_that_does_not_fit():
    assert observed(MovedCameraMonitor(1), [float("inf")] * 100) == pytest.approx(1e3)
