"""Stand-ins of the cameras' libraries, where the packages would be."""

from __future__ import annotations

import sys
import time
import types

import cv2
import numpy as np
import pytest

from rhot.files.calibration import Exposure
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.sources.picamera import PiCamera
from testing.picamera2 import FakePicamera2, libcamera


@pytest.fixture
def picamera2(monkeypatch):
    """The stand-in's class."""
    FakePicamera2.made = []
    monkeypatch.setattr(FakePicamera2, "padding", 0)
    monkeypatch.setattr(FakePicamera2, "colour_space", None)
    monkeypatch.setitem(sys.modules, "picamera2", types.SimpleNamespace(Picamera2=FakePicamera2))
    monkeypatch.setitem(sys.modules, "libcamera", libcamera())
    return FakePicamera2


@pytest.fixture
def exposure():
    """What the stand-in exposes with, too."""
    return Exposure(exposure_us=8000.0, gain=2.5, red_gain=1.7, blue_gain=1.4)


@pytest.fixture
def opened(picamera2, exposure):
    """`opened(**fields of its table)`: a camera that runs, and the stand-in that it made."""

    def open_one(**fields):
        camera = PiCamera(CameraTable(name="left", **fields), 0, exposure)
        camera.open()
        return camera, picamera2.made[-1]

    return open_one


class FakeCapture:
    """cv2.VideoCapture of a V4L2 camera, as far as it is used.

    Controls in `refused` cannot be set, device 9 is not there.
    """

    def __init__(self, device=0, api=cv2.CAP_V4L2, refused=()):
        self.device, self.api, self.refused = device, api, refused
        self.values: dict[int, float] = {
            cv2.CAP_PROP_EXPOSURE: 80.0,
            cv2.CAP_PROP_GAIN: 3.0,
            cv2.CAP_PROP_WHITE_BALANCE_RED_V: 1.0,
            cv2.CAP_PROP_WHITE_BALANCE_BLUE_U: 1.0,
        }
        self.opened = device != 9
        self.images = [np.full((480, 640, 3), n, np.uint8) for n in range(3)]
        self.position_ms: float | None = None

    def isOpened(self):  # noqa: N802 - OpenCV's name
        return self.opened

    def set(self, key, value):
        if key in self.refused:
            return False
        self.values[key] = value
        return True

    def get(self, key):
        if key != cv2.CAP_PROP_POS_MSEC:
            return self.values.get(key, -1.0)
        return time.monotonic_ns() * 1e-6 - 12.0 if self.position_ms is None else self.position_ms

    def read(self):
        return (True, self.images.pop(0)) if self.images else (False, None)

    def release(self):
        self.opened = False


@pytest.fixture
def video_capture():
    """The stand-in's class."""
    return FakeCapture
