"""Each fault of a camera begins when its pictures are so, and ends when they are well again."""

from __future__ import annotations

import pytest

from services.pi_tracker.monitors.camera_monitor import CameraMonitor
from services.pi_tracker.sources.video import VideoReader

SECONDS = 7


def well(film):
    return [film.frame(n) for n in range(30 * SECONDS)]


def test_good_pictures_are_no_fault_and_all_are_new(film, monitor):
    told, new = film.show(monitor, well(film))
    assert not any(told)
    assert new == 30 * SECONDS
    assert monitor.rate_hz == pytest.approx(30.0, rel=0.02)


# A covered sensor at full gain; a lamp before the lens; white clipped, so that pictures repeat;
# black that is clipped.
@pytest.mark.parametrize(
    ("code", "luma", "sigma", "clip"),
    [
        ("camera_dark", 17.0, 8.0, (16, 255)),
        ("camera_dark", 10.0, 0.5, (16, 235)),
        ("camera_saturated", 240.0, 5.0, (0, 255)),
        ("camera_saturated", 250.0, 2.0, (0, 235)),
    ],
)
def test_black_and_white_pictures(film, monitor, code, luma, sigma, clip):
    film.show(monitor, well(film))
    told, _ = film.show(
        monitor, [film.filled(n, luma, sigma, clip) for n in range(30 * SECONDS)], 0
    )
    assert list(told[-1]) == [code]
    assert "'left'" in told[-1][code]
    told, _ = film.show(monitor, well(film))
    assert not told[-1]


def test_a_dark_room_in_which_markers_are_found_is_not_dark(film, monitor):
    told, _ = film.show(monitor, [film.filled(n, 20.0, 4.0) for n in range(30 * SECONDS)], 1)
    assert not any(told)


def test_a_frozen_camera_is_told_and_its_pictures_are_not_new(film, monitor):
    film.show(monitor, well(film))
    told, new = film.show(monitor, [film.frame(0)] * 30 * SECONDS)
    assert new == 1
    assert list(told[-1]) == ["camera_frozen"]
    assert "the same picture for" in told[-1]["camera_frozen"]
    assert monitor.repeated == 30 * SECONDS - 1
    told, new = film.show(monitor, well(film)[1:])
    assert not told[-1]
    assert new == 30 * SECONDS - 1


def test_a_webcam_that_sends_each_picture_twice_is_slow_not_frozen(film, monitor):
    told, new = film.show(monitor, [film.frame(n // 2) for n in range(30 * SECONDS)])
    assert new == 15 * SECONDS
    assert list(told[-1]) == ["camera_slow"]
    assert "15.0 pictures a second of 30" in told[-1]["camera_slow"]
    assert "came twice" in told[-1]["camera_slow"]
    assert not any("camera_frozen" in one for one in told)


def test_a_slow_camera_and_one_that_stops_and_comes_back(film, monitor):
    told, _ = film.show(monitor, well(film)[: 20 * SECONDS], fps=20.0)
    assert list(told[-1]) == ["camera_slow"]
    for _ in range(6):
        film.now_ns += 10**9
        told.append(monitor.beat(film.now_ns))
    assert "delivers 0.0" in told[-1]["camera_slow"]
    told, _ = film.show(monitor, well(film))
    assert not told[-1]


def test_a_camera_that_never_begins(monitor):
    beats = [monitor.beat(10**18 + n * 10**9) for n in range(16)]
    assert not any(beats[:-1])
    assert "no picture yet" in beats[-1]["camera_slow"]


def test_pictures_that_this_computer_leaves_out_are_told(film, monitor):
    film.show(monitor, well(film), fps=20.0)
    assert "7 were left out" in monitor.beat(film.now_ns, skipped=7)["camera_slow"]


def test_a_recording_is_as_it_is(film):
    recording = CameraMonitor("left", 30.0, live=False)
    told, new = film.show(recording, [film.frame(0)] * 30 * SECONDS, fps=10.0)
    assert new == 30 * SECONDS
    assert not any(told)


def test_a_real_webcam_has_none_of_these_faults(rhot_data):
    reader = VideoReader("cam", rhot_data / "color_video" / "ball2.mp4", 24.0)
    reader.open()
    monitor = CameraMonitor("cam", 24.0, live=True)
    frames = 0
    while (frame := reader.read()) is not None:
        assert monitor.is_new(frame, frame.stamp_ns)
        monitor.watch(frame, 0, frame.stamp_ns)
        if frames % 24 == 0:
            assert monitor.beat(frame.stamp_ns) == {}
        frames += 1
    reader.close()
    assert frames == 1004
