"""Controls, sensor modes, metadata and padded buffers of picamera2.

Pure, except that libcamera is imported for its names.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rhot.errors import SourceError
from rhot.files.calibration import Exposure
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.image.frame import Image

# The automatics of exposure and white balance switched on.
AUTOMATIC: dict[str, Any] = {"AeEnable": True, "AwbEnable": True}
# A control is reported with the request that carried it, which is one of the first four; two
# seconds of frames are long over by then.
_CONFIRMED_S = 2.0
# Sensors know whole lines (34 us, 40 when binned) and steps of gain (an imx219's are 9 % at its
# highest). Automatics that run are further off than that, or will be.
_EXPOSURE_SLACK, _EXPOSURE_STEP_US, _GAIN_SLACK, _COLOUR_SLACK = 0.02, 50.0, 0.1, 0.02


def sync_control(table: CameraTable) -> dict[str, Any]:
    """The control that gives a camera its role in software synchronisation."""
    if table.sync == "off":
        return {}
    controls = importlib.import_module("libcamera").controls
    roles = getattr(getattr(controls, "rpi", None), "SyncModeEnum", None)
    if roles is None:
        raise SourceError(
            f"camera {table.name!r}: this libcamera cannot synchronise; "
            'run `sudo apt full-upgrade`, or set sync = "off"'
        )
    return {"SyncMode": roles.Server if table.sync == "server" else roles.Client}


def plain_picture() -> dict[str, Any]:
    """The controls that leave a picture as the sensor saw it: nothing sharpened or denoised.

    picamera2's video configurations denoise (NoiseReductionMode Fast), and the Pi's tuning files
    sharpen. Noise reduction goes in as libcamera's enum (raspberrypi/picamera2 #468), sharpness as
    a float (#810).
    """
    controls: dict[str, Any] = {
        "Sharpness": 0.0,
        "Brightness": 0.0,
        "Contrast": 1.0,
        "Saturation": 1.0,
    }
    draft = getattr(importlib.import_module("libcamera").controls, "draft", None)
    modes = getattr(draft, "NoiseReductionModeEnum", None)
    return controls if modes is None else controls | {"NoiseReductionMode": modes.Off}


def is_full_range(colour_space: Any) -> bool:
    """Whether a stream of libcamera's colour space has Y in 0..255 instead of 16..235."""
    return bool(colour_space.range == importlib.import_module("libcamera").ColorSpace.Range.Full)


def is_bt601(colour_space: Any) -> bool:
    """Whether chroma is BT.601's, as the colour tables take it to be."""
    encodings = importlib.import_module("libcamera").ColorSpace.YcbcrEncoding
    return bool(colour_space.ycbcrEncoding == encodings.Rec601)


def fixed_exposure(exposure: Exposure) -> dict[str, Any]:
    """The controls that fix an exposure."""
    return {
        "AeEnable": False,
        "AwbEnable": False,
        "ExposureTime": round(exposure.exposure_us),
        "AnalogueGain": exposure.gain,
        "ColourGains": (exposure.red_gain, exposure.blue_gain),
    }


def reported_exposure(metadata: dict[str, Any]) -> Exposure | None:
    """What an image was taken with; None if the metadata do not say all of it."""
    exposure_us, gain, gains = (
        metadata.get(key) for key in ("ExposureTime", "AnalogueGain", "ColourGains")
    )
    if not exposure_us or gain is None or gains is None or len(gains) != 2:
        return None
    return Exposure(
        exposure_us=float(exposure_us),
        gain=float(gain),
        red_gain=float(gains[0]),
        blue_gain=float(gains[1]),
    )


@dataclass
class ControlCheck:
    """Compares what the camera's frames report with what was asked of it.

    wanted are controls as they were set. Feed it every frame; `problem` is "" as long as nothing is
    known to be wrong, and final `frames` frames after the controls were set.
    """

    wanted: dict[str, Any]
    fps: float
    problem: str = ""
    _reported: dict[str, float] = field(default_factory=dict)
    _frames: int = 0

    @property
    def done(self) -> bool:
        """Whether nothing more is looked for: all was reported, or enough frames have come."""
        return self._complete()

    def _complete(self) -> bool:
        return len(self._reported) == len(self.wanted) or self._frames > _CONFIRMED_S * self.fps

    def update(self, metadata: Mapping[str, Any]) -> None:
        """Take in the metadata of one frame."""
        if self.done:
            return
        self._frames += 1
        for name in self.wanted.keys() & metadata.keys():
            self._reported[name] = _number(metadata[name])
        if self._complete():
            self.problem = ", ".join(
                f"{name} is {self._reported[name]:g} instead of {_number(value):g}"
                if name in self._reported
                else f"{name} = {_number(value):g} is not confirmed"
                for name, value in self.wanted.items()
                if self._reported.get(name) != _number(value)
            )


def _number(value: Any) -> float:
    """A control's value; libcamera's enums are numbers that float() does not take."""
    return value if isinstance(value, float) else float(int(value))


def other_exposure(wanted: Exposure, reported: Exposure) -> str:
    """How the exposure of a frame differs from what was fixed; "" if it does not."""
    slack_us = _EXPOSURE_SLACK * wanted.exposure_us + _EXPOSURE_STEP_US
    parts = [
        ("exposure_us", abs(reported.exposure_us - wanted.exposure_us) > slack_us),
        ("gain", abs(reported.gain - wanted.gain) > _GAIN_SLACK * wanted.gain),
        *(
            (name, abs(getattr(reported, name) / getattr(wanted, name) - 1.0) > _COLOUR_SLACK)
            for name in ("red_gain", "blue_gain")
        ),
    ]
    return ", ".join(
        f"{name} is {getattr(reported, name):g} instead of {getattr(wanted, name):g}"
        for name, differs in parts
        if differs
    )


def best_sensor_mode(modes: list[dict[str, Any]], table: CameraTable) -> dict[str, Any] | None:
    """The sensor mode with the largest field of view at the wanted rate.

    Of those the smallest that covers the image; None if no mode does.
    """
    usable = [
        mode
        for mode in modes
        if "crop_limits" in mode
        and mode["fps"] >= table.fps
        and mode["size"][1] >= table.size_px[1]
    ]
    return min(
        usable,
        key=lambda mode: (-mode["crop_limits"][2] * mode["crop_limits"][3], mode["size"][0]),
        default=None,
    )


def unpadded(buffer: Image, size_px: tuple[int, int], stride: int) -> Image:
    """A YUV420 buffer (n,) as packed I420 (height * 3 / 2, width).

    Its rows are padded to `stride` bytes (chroma: half of it).
    """
    width, height = size_px
    needed = stride * height * 3 // 2
    if buffer.size < needed:
        raise SourceError(
            f"camera buffer of {buffer.size} bytes is too small for {width}x{height} YUV420 "
            f"at stride {stride} ({needed})"
        )
    if stride == width:
        return buffer[:needed].reshape(height * 3 // 2, width)
    luma = buffer[: stride * height].reshape(height, stride)[:, :width]
    chroma = buffer[stride * height : needed].reshape(height, stride // 2)[:, : width // 2]
    return np.concatenate([luma.ravel(), chroma.ravel()]).reshape(height * 3 // 2, width)
