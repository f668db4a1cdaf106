"""Cameras, against stand-ins of their libraries' interfaces."""

from __future__ import annotations

import sys
import time
import types
from concurrent.futures import Future
from typing import ClassVar

import cv2
import numpy as np
import pytest

from rhot import clock
from rhot.calibration import Exposure
from rhot.config import CameraTable
from rhot.errors import SourceError
from services.pi_tracker.sources.picamera import PiCamera, unpadded
from services.pi_tracker.sources.v4l2 import OpenCvCamera

EXPOSURE = Exposure(exposure_us=8000.0, gain=2.5, red_gain=1.7, blue_gain=1.4)
WALL_NS = 1_700_000_000_123_456_789


class FakeRequest:
    """picamera2's CompletedRequest: a flat buffer with padded rows, metadata by name, to be released once."""

    def __init__(self, camera):
        self._camera = camera
        self.released = 0

    def make_buffer(self, name):
        assert name == "main"
        main = self._camera.camera_configuration()["main"]
        (width, height), stride = main["size"], main["stride"]
        luma = np.full((height, stride), 255, np.uint8)
        luma[:, :width] = np.arange(height)[:, None] % 200
        chroma = np.full((2, height // 2, stride // 2), 255, np.uint8)
        chroma[0, :, : width // 2], chroma[1, :, : width // 2] = 90, 160
        # libcamera's frame sizes are rounded up: there is something behind the last row.
        return np.concatenate([luma.ravel(), chroma.ravel(), np.zeros(64, np.uint8)])

    def get_metadata(self):
        return dict(self._camera.metadata)

    def release(self):
        self.released += 1


class FakeJob:
    """picamera2's Job: a future."""

    def __init__(self, result):
        self._future = Future()
        if result is not None:
            self._future.set_result(result)

    def get_result(self, timeout=None):
        return self._future.result(timeout=min(timeout, 0.01) if not self._future.done() else timeout)


class FakePicamera2:
    """picamera2.Picamera2 as far as it is used, with its checks."""

    made: ClassVar[list[FakePicamera2]] = []
    cameras: ClassVar = [{"Model": "ov5647", "Num": 0}]
    padding = 0

    @staticmethod
    def global_camera_info():
        return FakePicamera2.cameras

    def __init__(self, camera_num=0):
        self.camera_properties = {"Model": FakePicamera2.cameras[camera_num]["Model"]}
        self.metadata = {"FrameWallClock": WALL_NS, "ExposureTime": 8000, "SensorTimestamp": 12345}
        self.started = self.closed = self.silent = False
        self.requests = []
        self._config = None
        FakePicamera2.made.append(self)

    @property
    def sensor_modes(self):
        mode = {"format": "SGBRG10", "unpacked": "SGBRG10", "bit_depth": 10, "exposure_limits": (134, 1_000_000)}
        return [
            {**mode, "size": (640, 480), "fps": 58.92, "crop_limits": (16, 0, 2560, 1920)},
            {**mode, "size": (1296, 972), "fps": 46.34, "crop_limits": (0, 0, 2592, 1944)},
            {**mode, "size": (2592, 1944), "fps": 15.63, "crop_limits": (0, 0, 2592, 1944)},
            {"format": "MJPEG"},
        ]

    def create_video_configuration(self, main=None, colour_space=None, buffer_count=6, controls=None, queue=True, sensor=None):
        assert main["format"] == "YUV420"
        assert set(sensor) <= {"bit_depth", "output_size"}
        return {
            "main": dict(main),
            "colour_space": colour_space,
            "buffer_count": buffer_count,
            "controls": controls,
            "queue": queue,
            "sensor": sensor,
        }

    def configure(self, config):
        assert not self.started
        width, _ = config["main"]["size"]
        self._config = {**config, "main": {**config["main"], "stride": width + FakePicamera2.padding}}

    def camera_configuration(self):
        return self._config

    def start(self):
        if self._config is None:
            raise RuntimeError("Camera not configured")
        self.started = True

    def capture_request(self, wait=None):
        assert wait is False
        self.requests.append(FakeRequest(self))
        return FakeJob(None if self.silent else self.requests[-1])

    def close(self):
        self.closed = True


@pytest.fixture
def picamera2(monkeypatch):
    """The stand-in where the package would be."""
    FakePicamera2.made = []
    monkeypatch.setattr(FakePicamera2, "padding", 0)
    monkeypatch.setitem(sys.modules, "picamera2", types.SimpleNamespace(Picamera2=FakePicamera2))
    space = types.SimpleNamespace(Smpte170m=lambda: "smpte170m")
    monkeypatch.setitem(sys.modules, "libcamera", types.SimpleNamespace(ColorSpace=space))
    return FakePicamera2


def table(**fields):
    return CameraTable(name="left", **fields)


@pytest.mark.parametrize("padding", [0, 64])
def test_a_pi_camera_delivers_packed_i420(picamera2, monkeypatch, padding):
    monkeypatch.setattr(picamera2, "padding", padding)
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    frame = camera.read()
    assert (frame.image.shape, frame.layout, frame.size_px) == ((720, 640), "i420", (640, 480))
    assert np.array_equal(frame.image[:480], np.broadcast_to((np.arange(480) % 200)[:, None], (480, 640)))
    chroma = frame.image[480:].reshape(2, 240, 320)
    assert (np.unique(chroma[0]), np.unique(chroma[1])) == ([90], [160])
    assert camera.read().seq == 1
    camera.close()
    (made,) = picamera2.made
    assert [request.released for request in made.requests] == [1, 1]
    assert made.closed


def test_a_pi_camera_stamps_the_middle_of_its_first_row(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    frame = camera.read()
    assert frame.stamp_ns == WALL_NS - 4_000_000
    # 46 fps with the whole field of view: 972 lines of 33.7 us are read for 480 rows.
    assert frame.row_time_ns == pytest.approx(33_700 * 972 / 480)


def test_a_pi_cameras_auto_modes_are_off(picamera2):
    camera = PiCamera(table(fps=40.0), 0, EXPOSURE)
    camera.open()
    config = picamera2.made[0].camera_configuration()
    assert config["controls"] == {
        "FrameDurationLimits": (25_000, 25_000),
        "AeEnable": False,
        "AwbEnable": False,
        "ExposureTime": 8000,
        "AnalogueGain": 2.5,
        "ColourGains": (1.7, 1.4),
    }
    assert config["colour_space"] == "smpte170m"
    assert config["queue"] is False
    assert config["sensor"] == {"output_size": (1296, 972), "bit_depth": 10}
    assert camera.notes == []


def test_a_fast_pi_camera_takes_the_mode_that_is_fast_enough(picamera2):
    camera = PiCamera(table(fps=58.0), 0, EXPOSURE)
    camera.open()
    assert picamera2.made[0].camera_configuration()["sensor"]["output_size"] == (640, 480)
    assert camera.read().row_time_ns == pytest.approx(33_700)


def test_a_pi_camera_without_calibration_says_so(picamera2):
    camera = PiCamera(table(), 0, None)
    camera.open()
    assert set(picamera2.made[0].camera_configuration()["controls"]) == {"FrameDurationLimits"}
    assert any("rhot calibrate camera left" in note for note in camera.notes)


@pytest.fixture
def roles(picamera2, monkeypatch):
    """libcamera with software synchronisation: its controls.rpi.SyncModeEnum."""
    found = types.SimpleNamespace(Off=0, Server=1, Client=2)
    monkeypatch.setattr(sys.modules["libcamera"], "controls", types.SimpleNamespace(rpi=types.SimpleNamespace(SyncModeEnum=found)), False)
    return found


@pytest.mark.parametrize(("sync", "role"), [("server", "Server"), ("client", "Client")])
def test_pi_cameras_are_told_their_part_in_synchronisation(picamera2, roles, sync, role):
    source = PiCamera(table(sync=sync), 0, EXPOSURE)
    source.open()
    assert picamera2.made[0].camera_configuration()["controls"]["SyncMode"] == getattr(roles, role)
    picamera2.made[0].metadata["SyncReady"] = True
    for _ in range(1000):
        source.read()
    assert source.notes == []


def test_a_client_without_a_server_says_so_once_and_delivers(picamera2, roles):
    source = PiCamera(table(sync="client"), 0, EXPOSURE)
    source.open()
    picamera2.made[0].metadata["SyncReady"] = False
    assert [source.read().seq for _ in range(1000)] == list(range(1000))
    assert [note for note in source.notes if "not in step" in note] == source.notes
    assert len(source.notes) == 1


def test_synchronising_at_full_speed_is_advised_against(picamera2, roles):
    source = PiCamera(table(sync="client", fps=46.3), 0, EXPOSURE)
    source.open()
    assert any("lower" in note for note in source.notes)


def test_an_old_libcamera_cannot_synchronise(picamera2, monkeypatch):
    monkeypatch.setattr(sys.modules["libcamera"], "controls", types.SimpleNamespace(), False)
    with pytest.raises(SourceError, match="cannot synchronise"):
        PiCamera(table(sync="server"), 0, EXPOSURE).open()


def test_an_unknown_sensor_has_no_row_time(picamera2, monkeypatch):
    monkeypatch.setattr(picamera2, "cameras", [{"Model": "imx999"}])
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    assert camera.read().row_time_ns == 0.0
    assert any("readout time is unknown" in note for note in camera.notes)


def test_a_pi_camera_that_falls_silent_fails(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    camera.read()
    picamera2.made[0].silent = True
    with pytest.raises(SourceError, match="camera 'left': no image for 2 s"):
        camera.read()


def test_an_old_system_without_wall_clock_stamps_fails(picamera2):
    camera = PiCamera(table(), 0, EXPOSURE)
    camera.open()
    del picamera2.made[0].metadata["FrameWallClock"]
    with pytest.raises(SourceError, match="no FrameWallClock; update with `sudo apt full-upgrade`"):
        camera.read()
    assert picamera2.made[0].requests[0].released == 1


def test_a_pi_camera_that_is_not_there_is_named(picamera2):
    with pytest.raises(SourceError, match="has no camera 3; it has 0: ov5647"):
        PiCamera(table(), 3, EXPOSURE).open()


def test_a_pi_camera_in_use_is_named(picamera2, monkeypatch):
    def busy(self):
        raise RuntimeError("Failed to acquire camera: Device or resource busy")

    monkeypatch.setattr(picamera2, "start", busy)
    with pytest.raises(SourceError, match=r"cannot be started: .*busy; does another program use it"):
        PiCamera(table(), 0, EXPOSURE).open()


def test_a_missing_package_is_named_with_its_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    with pytest.raises(SourceError, match="sudo apt install python3-picamera2"):
        PiCamera(table(), 0, EXPOSURE).open()


def test_a_buffer_that_is_too_small_is_refused():
    with pytest.raises(SourceError, match="too small for 64x48"):
        unpadded(np.zeros(1000, np.uint8), (64, 48), 64)


class FakeCapture:
    """cv2.VideoCapture as far as it is used."""

    def __init__(self, device, api):
        self.device, self.api = device, api
        self.values: dict[int, float] = {}
        self.opened = device != 9
        self.images = [np.full((480, 640, 3), n, np.uint8) for n in range(3)]
        self.position_ms: float | None = None

    def isOpened(self):  # noqa: N802 - OpenCV's name
        return self.opened

    def set(self, key, value):
        self.values[key] = value
        return key != cv2.CAP_PROP_WHITE_BALANCE_RED_V

    def get(self, key):
        assert key == cv2.CAP_PROP_POS_MSEC
        return time.monotonic_ns() * 1e-6 - 12.0 if self.position_ms is None else self.position_ms

    def read(self):
        return (True, self.images.pop(0)) if self.images else (False, None)

    def release(self):
        self.opened = False


def test_a_usb_camera_is_set_by_hand_and_stamped_by_its_driver():
    made: list[FakeCapture] = []

    def capture(device, api):
        made.append(FakeCapture(device, api))
        return made[0]

    camera = OpenCvCamera(table(fps=25.0), 0, EXPOSURE, capture=capture)
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
    assert camera.notes == ["camera 'left': the driver refuses red gain = 1.7"]
    frame = camera.read()
    assert (frame.layout, frame.size_px, frame.seq) == ("bgr", (640, 480), 0)
    # 12 ms old, and half of 8 ms exposure before that.
    assert clock.now_ns() - frame.stamp_ns == pytest.approx(16e6, abs=5e6)
    made[0].position_ms = 0.0
    assert clock.now_ns() - camera.read().stamp_ns == pytest.approx(4e6, abs=5e6)
    camera.read()
    with pytest.raises(SourceError, match="camera 'left': 0 delivers no more images; is it unplugged"):
        camera.read()
    camera.close()
    assert not made[0].opened


def test_a_usb_camera_that_is_not_there_is_named():
    with pytest.raises(SourceError, match="camera 'left': 9 cannot be opened"):
        OpenCvCamera(table(), 9, EXPOSURE, capture=FakeCapture).open()
    with pytest.raises(SourceError, match="needs GStreamer support"):
        OpenCvCamera(table(), 9, None, cv2.CAP_GSTREAMER, FakeCapture).open()
