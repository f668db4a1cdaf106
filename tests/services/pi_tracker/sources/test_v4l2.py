"""USB cameras through OpenCV, against the stand-in of its VideoCapture."""

from __future__ import annotations

import cv2
import pytest

from rhot import clock
from rhot.errors import SourceError
from rhot.files.calibration import Exposure
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.sources.threaded import ThreadedSource
from services.pi_tracker.sources.v4l2 import OpenCvCamera
from services.pi_tracker.sources.video import VideoReader

EXPOSURE = Exposure(exposure_us=8000.0, gain=2.5, red_gain=1.7, blue_gain=1.4)


def table(**fields):
    return CameraTable(name="left", **fields)


def test_a_usb_camera_is_set_by_hand_and_stamped_by_its_driver(video_capture):
    made = []

    def capture(device, api):
        made.append(video_capture(device, api, refused={cv2.CAP_PROP_WHITE_BALANCE_RED_V}))
        return made[0]

    camera = OpenCvCamera(table(fps=25.0), 0, EXPOSURE, open_capture=capture)
    camera.open()
    assert made[0].api == cv2.CAP_V4L2
    wanted = {
        cv2.CAP_PROP_AUTO_EXPOSURE: 1,
        cv2.CAP_PROP_EXPOSURE: 80.0,
        cv2.CAP_PROP_AUTO_WB: 0,
        cv2.CAP_PROP_GAIN: 2.5,
        cv2.CAP_PROP_FPS: 25.0,
    }
    assert wanted.items() <= made[0].values.items()
    assert camera.notes.standing() == {
        ("camera_setting", "left red gain"): "camera 'left': the driver refuses red gain = 1.7"
    }
    frame = camera.read()
    assert (frame.layout, frame.size_px, frame.seq) == ("bgr", (640, 480), 0)
    # 12 ms old, and half of 8 ms exposure before that.
    assert clock.now_ns() - frame.stamp_ns == pytest.approx(16e6, abs=5e6)
    made[0].position_ms = 0.0
    assert clock.now_ns() - camera.read().stamp_ns == pytest.approx(4e6, abs=5e6)
    camera.read()
    with pytest.raises(
        SourceError, match="camera 'left': 0 delivers no more images; is it unplugged"
    ):
        camera.read()
    camera.close()
    assert not made[0].opened


def test_a_usb_camera_that_is_not_there_is_named(video_capture):
    with pytest.raises(SourceError, match="camera 'left': 9 cannot be opened"):
        OpenCvCamera(table(), 9, EXPOSURE, open_capture=video_capture).open()
    with pytest.raises(SourceError, match="needs GStreamer support"):
        OpenCvCamera(table(), 9, None, cv2.CAP_GSTREAMER, video_capture).open()


def test_a_usb_camera_runs_its_automatics_and_freezes_them(video_capture):
    fake = video_capture()
    camera = OpenCvCamera(table(), 0, EXPOSURE, open_capture=lambda *_: fake)
    camera.open()
    camera.controls.adjust(None)
    fake.values[cv2.CAP_PROP_EXPOSURE] = 120.0
    camera.read()
    assert (fake.values[cv2.CAP_PROP_AUTO_EXPOSURE], fake.values[cv2.CAP_PROP_AUTO_WB]) == (3, 1)
    assert camera.controls.reported.exposure_us == 12_000.0
    camera.controls.adjust(EXPOSURE)
    camera.read()
    assert (fake.values[cv2.CAP_PROP_AUTO_EXPOSURE], fake.values[cv2.CAP_PROP_EXPOSURE]) == (
        1,
        80.0,
    )


def test_a_usb_driver_without_values_reports_nothing(video_capture):
    fake = video_capture()
    del fake.values[cv2.CAP_PROP_WHITE_BALANCE_RED_V]
    camera = OpenCvCamera(table(), 0, None, open_capture=lambda *_: fake)
    camera.open()
    assert list(camera.notes.standing()) == [("camera_automatic", "left")]
    camera.controls.adjust(None)
    camera.read()
    assert camera.controls.reported is None
    camera.controls.adjust(EXPOSURE)
    camera.read()
    assert ("camera_automatic", "left") not in camera.notes.standing()


def test_sources_without_such_controls_have_none(tmp_path):
    assert ThreadedSource(VideoReader("left", tmp_path / "none.mp4", 30.0)).controls is None
    assert OpenCvCamera(table(), "videotestsrc ! appsink", None, cv2.CAP_GSTREAMER).controls is None
    assert ThreadedSource(OpenCvCamera(table(), 0, None)).controls is not None
