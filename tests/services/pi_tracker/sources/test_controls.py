"""Exposure of cameras that run, against stand-ins of their libraries."""

from __future__ import annotations

import sys
import types
from concurrent.futures import Future

import cv2
import numpy as np
import pytest

from rhot.calibration import Exposure
from rhot.config import CameraTable
from services.pi_tracker.sources.picamera import PiCamera
from services.pi_tracker.sources.reader import Threaded
from services.pi_tracker.sources.v4l2 import OpenCvCamera
from services.pi_tracker.sources.video import VideoReader

EXPOSURE = Exposure(exposure_us=8000.0, gain=2.5, red_gain=1.7, blue_gain=1.4)
TABLE = CameraTable(name="left", size_px=(64, 48))


class FakePicamera2:
    """picamera2.Picamera2 whose automatics change what its metadata say."""

    sensor_modes = ()
    camera_properties = types.MappingProxyType({"Model": "ov5647"})

    def __init__(self, camera_num=0):
        self.set = []
        self.metadata = {"FrameWallClock": 10**18, "ExposureTime": 12_000, "AnalogueGain": 1.5, "ColourGains": (1.9, 1.3)}

    @staticmethod
    def global_camera_info():
        return [{"Model": "ov5647", "Num": 0}]

    def create_video_configuration(self, **config):
        return config

    def configure(self, config):
        self._config = {**config, "main": {**config["main"], "stride": config["main"]["size"][0]}}

    def camera_configuration(self):
        return self._config

    def start(self):
        pass

    def set_controls(self, controls):
        self.set.append(controls)

    def capture_request(self, wait=None):
        request = types.SimpleNamespace(
            get_metadata=lambda: dict(self.metadata), make_buffer=lambda _: np.zeros(64 * 48 * 3 // 2, np.uint8), release=lambda: None
        )
        future = Future()
        future.set_result(request)
        return types.SimpleNamespace(get_result=lambda timeout=None: future.result(timeout))


@pytest.fixture
def pi_camera(monkeypatch):
    """A PiCamera on the stand-in, opened, and the stand-in."""
    made = []

    def make(number):
        made.append(FakePicamera2(number))
        return made[-1]

    make.global_camera_info = FakePicamera2.global_camera_info
    monkeypatch.setitem(sys.modules, "picamera2", types.SimpleNamespace(Picamera2=make))
    monkeypatch.setitem(sys.modules, "libcamera", types.SimpleNamespace(ColorSpace=types.SimpleNamespace(Smpte170m=lambda: "smpte170m")))
    camera = PiCamera(TABLE, 0, EXPOSURE)
    camera.open()
    return camera, made[0]


def test_a_pi_camera_runs_its_automatics_and_freezes_them(pi_camera):
    camera, fake = pi_camera
    camera.read()
    assert fake.set == []
    camera.controls.adjust(None)
    camera.read()
    assert fake.set == [{"AeEnable": True, "AwbEnable": True}]
    assert camera.controls.reported == Exposure(exposure_us=12_000.0, gain=1.5, red_gain=1.9, blue_gain=1.3)
    camera.controls.adjust(EXPOSURE)
    camera.read()
    camera.read()
    assert fake.set[1:] == [{"AeEnable": False, "AwbEnable": False, "ExposureTime": 8000, "AnalogueGain": 2.5, "ColourGains": (1.7, 1.4)}]


@pytest.mark.parametrize("missing", ["ExposureTime", "AnalogueGain", "ColourGains"])
def test_metadata_that_say_half_report_nothing(pi_camera, missing):
    camera, fake = pi_camera
    del fake.metadata[missing]
    camera.read()
    assert camera.controls.reported is None


class FakeCapture:
    """cv2.VideoCapture of a V4L2 camera with manual controls."""

    def __init__(self):
        self.values = {cv2.CAP_PROP_EXPOSURE: 80.0, cv2.CAP_PROP_GAIN: 3.0}
        self.values |= {cv2.CAP_PROP_WHITE_BALANCE_RED_V: 1.0, cv2.CAP_PROP_WHITE_BALANCE_BLUE_U: 1.0, cv2.CAP_PROP_POS_MSEC: 0.0}

    def isOpened(self):  # noqa: N802
        return True

    def set(self, key, value):
        self.values[key] = value
        return True

    def get(self, key):
        return self.values.get(key, -1.0)

    def read(self):
        return True, np.zeros((48, 64, 3), np.uint8)

    def release(self):
        pass


def test_a_usb_camera_runs_its_automatics_and_freezes_them():
    fake = FakeCapture()
    camera = OpenCvCamera(TABLE, 0, EXPOSURE, capture=lambda *_: fake)
    camera.open()
    camera.controls.adjust(None)
    fake.values[cv2.CAP_PROP_EXPOSURE] = 120.0
    camera.read()
    assert (fake.values[cv2.CAP_PROP_AUTO_EXPOSURE], fake.values[cv2.CAP_PROP_AUTO_WB]) == (3, 1)
    assert camera.controls.reported.exposure_us == 12_000.0
    camera.controls.adjust(EXPOSURE)
    camera.read()
    assert (fake.values[cv2.CAP_PROP_AUTO_EXPOSURE], fake.values[cv2.CAP_PROP_EXPOSURE]) == (1, 80.0)


def test_a_usb_driver_without_values_reports_nothing():
    fake = FakeCapture()
    del fake.values[cv2.CAP_PROP_WHITE_BALANCE_RED_V]
    camera = OpenCvCamera(TABLE, 0, None, capture=lambda *_: fake)
    camera.open()
    camera.controls.adjust(None)
    camera.read()
    assert camera.controls.reported is None


def test_sources_without_such_controls_have_none(tmp_path):
    assert Threaded(VideoReader("left", tmp_path / "none.mp4", 30.0)).controls is None
    assert OpenCvCamera(TABLE, "videotestsrc ! appsink", None, cv2.CAP_GSTREAMER).controls is None
    assert Threaded(OpenCvCamera(TABLE, 0, None)).controls is not None
