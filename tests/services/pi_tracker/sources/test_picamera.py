"""The Raspberry Pi's camera, against the stand-in of picamera2: pictures, stamps, what fails."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from rhot.errors import SourceError
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.sources.picamera import PiCamera
from testing.picamera2 import PLAIN_PICTURE

TABLE = CameraTable(name="left")


@pytest.mark.parametrize("padding", [0, 64])
def test_a_camera_delivers_packed_i420(opened, picamera2, monkeypatch, padding):
    monkeypatch.setattr(picamera2, "padding", padding)
    camera, made = opened()
    frame = camera.read()
    assert (frame.image.shape, frame.layout, frame.size_px) == ((720, 640), "i420", (640, 480))
    assert np.array_equal(
        frame.image[:480], np.broadcast_to((np.arange(480) % 200)[:, None], (480, 640))
    )
    chroma = frame.image[480:].reshape(2, 240, 320)
    assert (np.unique(chroma[0]), np.unique(chroma[1])) == ([90], [160])
    assert camera.read().seq == 1
    camera.close()
    assert [request.released for request in made.requests] == [1, 1]
    assert made.closed


def test_a_camera_stamps_the_middle_of_its_first_row(opened, picamera2):
    camera, _ = opened()
    frame = camera.read()
    assert frame.stamp_ns == picamera2.WALL_NS - 4_000_000
    # 46 fps with the whole field of view: 972 lines of 33.7 us are read for 480 rows.
    assert frame.row_time_ns == pytest.approx(33_700 * 972 / 480)


def test_a_camera_without_calibration_says_so(picamera2, exposure):
    camera = PiCamera(TABLE, 0, None)
    camera.open()
    controls = picamera2.made[0].camera_configuration()["controls"]
    # No exposure among them, and nothing that switches the automatics off.
    assert set(controls) == {"FrameDurationLimits", *PLAIN_PICTURE}
    assert camera.notes.standing().keys() == {("camera_automatic", "left")}
    camera.controls.adjust(exposure)
    camera.read()
    assert camera.notes.texts == []


def test_an_unknown_sensor_has_no_row_time(opened, picamera2, monkeypatch):
    monkeypatch.setattr(picamera2, "cameras", [{"Model": "imx999"}])
    camera, _ = opened()
    assert camera.read().row_time_ns == 0.0
    assert any("readout time is unknown" in text for text in camera.notes.texts)


def test_a_camera_that_falls_silent_fails(opened):
    camera, made = opened()
    camera.read()
    made.silent = True
    with pytest.raises(SourceError, match="camera 'left': no image for 2 s"):
        camera.read()


def test_an_old_system_without_wall_clock_stamps_fails(opened):
    camera, made = opened()
    del made.metadata["FrameWallClock"]
    with pytest.raises(SourceError, match="no FrameWallClock; update with `sudo apt full-upgrade`"):
        camera.read()
    assert made.requests[0].released == 1


def test_a_camera_that_is_not_there_is_named(picamera2, exposure):
    with pytest.raises(SourceError, match="has no camera 3; it has 0: ov5647"):
        PiCamera(TABLE, 3, exposure).open()


def test_a_camera_in_use_is_named(picamera2, monkeypatch, exposure):
    def busy(self):
        raise RuntimeError("Failed to acquire camera: Device or resource busy")

    monkeypatch.setattr(picamera2, "start", busy)
    with pytest.raises(
        SourceError, match=r"cannot be started: .*busy; does another program use it"
    ):
        PiCamera(TABLE, 0, exposure).open()


def test_a_missing_package_is_named_with_its_command(monkeypatch, exposure):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    with pytest.raises(SourceError, match="sudo apt install python3-picamera2"):
        PiCamera(TABLE, 0, exposure).open()
