"""Stand-in of picamera2 and of libcamera's names, as far as the Pi's camera is driven, with their
checks.
"""

from __future__ import annotations

import enum
import types
from concurrent.futures import Future
from typing import ClassVar

import numpy as np

# What libcamera does to a picture, as it is told not to.
PLAIN_PICTURE = {
    "Sharpness": 0.0,
    "NoiseReductionMode": 0,
    "Brightness": 0.0,
    "Contrast": 1.0,
    "Saturation": 1.0,
}


# libcamera's names as its Python bindings have them. Its enums are numbers for int() only.
class Range(enum.Enum):
    Full = 0
    Limited = 1


class YcbcrEncoding(enum.Enum):
    Null = 0
    Rec601 = 1
    Rec709 = 2
    Rec2020 = 3


class NoiseReductionModeEnum(enum.Enum):
    Off = 0
    Fast = 1
    HighQuality = 2

    def __int__(self):
        return self.value


class ColorSpace:
    """libcamera.ColorSpace as far as it is used."""

    Range = Range
    YcbcrEncoding = YcbcrEncoding

    def __init__(self, name, encoding, span):
        self.name, self.ycbcrEncoding, self.range = name, encoding, span

    def __str__(self):
        return f"<libcamera.ColorSpace '{self.name}'>"

    @staticmethod
    def Smpte170m():  # noqa: N802 - libcamera's name
        return ColorSpace("SMPTE170M", YcbcrEncoding.Rec601, Range.Limited)

    @staticmethod
    def Sycc():  # noqa: N802 - libcamera's name
        return ColorSpace("sYCC", YcbcrEncoding.Rec601, Range.Full)

    @staticmethod
    def Rec709():  # noqa: N802 - libcamera's name
        return ColorSpace("Rec709", YcbcrEncoding.Rec709, Range.Limited)


class FakeRequest:
    """picamera2's CompletedRequest: a flat buffer with padded rows, metadata by name.

    To be released once.
    """

    def __init__(self, camera, carried):
        self._camera = camera
        # The controls that were set since the request before, which libcamera reports with this.
        self._carried = carried
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
        reported = {
            name: value if isinstance(value, (bool, float, tuple)) else int(value)
            for name, value in self._carried.items()
        }
        return {**reported, **self._camera.metadata}

    def release(self):
        self.released += 1


class FakeJob:
    """picamera2's Job: a future."""

    def __init__(self, result):
        self._future = Future()
        if result is not None:
            self._future.set_result(result)

    def get_result(self, timeout=None):
        return self._future.result(
            timeout=min(timeout, 0.01) if not self._future.done() else timeout
        )


class FakePicamera2:
    """picamera2.Picamera2 as far as it is used, with its checks.

    Controls that were set while it ran are in `set`.
    """

    WALL_NS = 1_700_000_000_123_456_789
    made: ClassVar[list[FakePicamera2]] = []
    cameras: ClassVar = [{"Model": "ov5647", "Num": 0}]
    padding = 0
    # What libcamera makes of the colour space it is asked for; None leaves it.
    colour_space = None
    # (least, most, default) of what can be set, by name.
    known: ClassVar = {
        "AeEnable": (False, True, True),
        "AwbEnable": (False, True, None),
        "ExposureTime": (1, 66_666, 20_000),
        "AnalogueGain": (1.0, 16.0, 1.0),
        "ColourGains": (0.0, 32.0, None),
        "FrameDurationLimits": (33_333, 120_000, 33_333),
        "NoiseReductionMode": (0, 4, 0),
        "Sharpness": (0.0, 16.0, 1.0),
        "Brightness": (-1.0, 1.0, 0.0),
        "Contrast": (0.0, 32.0, 1.0),
        "Saturation": (0.0, 32.0, 1.0),
        "SyncMode": (0, 2, 0),
    }

    @staticmethod
    def global_camera_info():
        return FakePicamera2.cameras

    def __init__(self, camera_num=0):
        self.camera_properties = {"Model": FakePicamera2.cameras[camera_num]["Model"]}
        self.metadata = {
            "FrameWallClock": self.WALL_NS,
            "ExposureTime": 8000,
            "AnalogueGain": 2.5,
            "ColourGains": (1.7, 1.4),
        }
        self.set = []
        self._carried = {}
        self.started = self.closed = self.silent = False
        self.requests = []
        self._config = None
        FakePicamera2.made.append(self)

    @property
    def camera_controls(self):
        return FakePicamera2.known

    @property
    def sensor_modes(self):
        mode = {
            "format": "SGBRG10",
            "unpacked": "SGBRG10",
            "bit_depth": 10,
            "exposure_limits": (134, 1_000_000),
        }
        return [
            {**mode, "size": (640, 480), "fps": 58.92, "crop_limits": (16, 0, 2560, 1920)},
            {**mode, "size": (1296, 972), "fps": 46.34, "crop_limits": (0, 0, 2592, 1944)},
            {**mode, "size": (2592, 1944), "fps": 15.63, "crop_limits": (0, 0, 2592, 1944)},
            {"format": "MJPEG"},
        ]

    def create_video_configuration(
        self, main=None, colour_space=None, buffer_count=6, controls=None, queue=True, sensor=None
    ):
        assert main["format"] == "YUV420"
        assert set(sensor) <= {"bit_depth", "output_size"}
        return {
            "main": dict(main),
            "colour_space": colour_space,
            "buffer_count": buffer_count,
            "controls": (
                {"NoiseReductionMode": NoiseReductionModeEnum.Fast} | controls
                if "NoiseReductionMode" in FakePicamera2.known
                else controls
            ),
            "queue": queue,
            "sensor": sensor,
        }

    def configure(self, config):
        assert not self.started
        self._advertised(config["controls"])
        width, _ = config["main"]["size"]
        self._config = {
            **config,
            "main": {**config["main"], "stride": width + FakePicamera2.padding},
        }

    def camera_configuration(self):
        return self._config

    @property
    def libcamera_config(self):
        space = FakePicamera2.colour_space or self._config["colour_space"]
        stream = types.SimpleNamespace(color_space=space)
        return types.SimpleNamespace(at=lambda index: (stream,)[index])

    @staticmethod
    def _advertised(controls):
        for name in controls:
            if name not in FakePicamera2.known:
                raise RuntimeError(f"Control {name} is not advertised by libcamera")

    def start(self):
        if self._config is None:
            raise RuntimeError("Camera not configured")
        self.started = True

    def set_controls(self, controls):
        assert self.started
        self._advertised(controls)
        self.set.append(controls)
        self._carried |= controls

    def capture_request(self, wait=None):
        assert wait is False
        self.requests.append(FakeRequest(self, self._carried))
        self._carried = {}
        return FakeJob(None if self.silent else self.requests[-1])

    def close(self):
        self.closed = True


def libcamera() -> types.SimpleNamespace:
    """The module of that name."""
    draft = types.SimpleNamespace(NoiseReductionModeEnum=NoiseReductionModeEnum)
    controls = types.SimpleNamespace(draft=draft)
    return types.SimpleNamespace(ColorSpace=ColorSpace, controls=controls)
