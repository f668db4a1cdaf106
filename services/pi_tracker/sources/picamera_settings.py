"""Controls, sensor modes, metadata and padded buffers of picamera2.

Pure, except that libcamera is imported for its names.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from rhot.errors import SourceError
from rhot.files.calibration import Exposure
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.image.frame import Image

# The automatics of exposure and white balance switched on.
AUTOMATIC: dict[str, Any] = {"AeEnable": True, "AwbEnable": True}


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
