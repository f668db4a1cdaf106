"""A USB camera through V4L2, or any camera through a GStreamer pipeline, by OpenCV.

Auto exposure and white balance are switched off and the calibrated values set; what the driver
refuses is noted. The driver stamps frames with CLOCK_MONOTONIC when they arrive. That is converted
to CLOCK_REALTIME, less half the exposure; a driver without stamps gets the time of reading. Rolling
shutter is unknown (row_time_ns 0). A camera that is missing, unplugged or silent is a SourceError.
Not tried on hardware.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import cv2

from rhot import clock
from rhot.errors import SourceError
from rhot.files.calibration import Exposure
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.controls import UNCALIBRATED, Controls
from services.pi_tracker.sources.notes import Notes

# V4L2_EXPOSURE_MANUAL and _APERTURE_PRIORITY of V4L2_CID_EXPOSURE_AUTO; V4L2_CID_EXPOSURE_ABSOLUTE
# counts in 100 us.
_MANUAL, _AUTOMATIC, _EXPOSURE_UNIT_US = 1, 3, 100.0
# A stamp further from now than this is not of this frame.
_MAX_AGE_NS = 2_000_000_000


class OpenCvCamera:
    """One camera.

    device is a number, a path such as /dev/video0, or a GStreamer pipeline; api an OpenCV CAP_
    constant; open_capture what opens the device.
    """

    live = True

    def __init__(
        self,
        table: CameraTable,
        device: int | str,
        exposure: Exposure | None,
        api: int = cv2.CAP_V4L2,
        open_capture: Callable[..., Any] = cv2.VideoCapture,
    ) -> None:
        self.notes = Notes(table.name)
        # A GStreamer pipeline has properties of its own for its exposure.
        self.controls = (
            Controls("what the driver reports while its automatics run may be old")
            if api == cv2.CAP_V4L2
            else None
        )
        self._table = table
        self._device = device
        self._exposure = exposure
        self._api = api
        self._open_capture = open_capture
        self._capture: Any = None
        self._seq = 0

    def open(self) -> None:
        self._capture = self._open_capture(self._device, self._api)
        if not self._capture.isOpened():
            hint = (
                "see `v4l2-ctl --list-devices`"
                if self._api == cv2.CAP_V4L2
                else "OpenCV needs GStreamer support (Debian's python3-opencv has it)"
            )
            raise SourceError(
                f"camera {self._table.name!r}: {self._device!r} cannot be opened; {hint} "
                "and check [[camera]] source in rig.toml"
            )
        if self._api != cv2.CAP_V4L2:
            return
        width, height = self._table.size_px
        self._set("frame width", cv2.CAP_PROP_FRAME_WIDTH, width)
        self._set("frame height", cv2.CAP_PROP_FRAME_HEIGHT, height)
        self._set("frame rate", cv2.CAP_PROP_FPS, self._table.fps)
        self._set("one buffer", cv2.CAP_PROP_BUFFERSIZE, 1)
        if self._exposure is not None:
            self._fix(self._exposure)
        else:
            self.notes.report("camera_automatic", UNCALIBRATED)

    def _fix(self, exposure: Exposure) -> None:
        self.notes.clear("camera_automatic")
        self._set("manual exposure", cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL)
        self._set("exposure", cv2.CAP_PROP_EXPOSURE, exposure.exposure_us / _EXPOSURE_UNIT_US)
        self._set("gain", cv2.CAP_PROP_GAIN, exposure.gain)
        self._set("manual white balance", cv2.CAP_PROP_AUTO_WB, 0)
        self._set("red gain", cv2.CAP_PROP_WHITE_BALANCE_RED_V, exposure.red_gain)
        self._set("blue gain", cv2.CAP_PROP_WHITE_BALANCE_BLUE_U, exposure.blue_gain)

    def _set(self, what: str, key: int, value: float) -> None:
        if self._capture.set(key, value):
            self.notes.clear("camera_setting", what)
        else:
            self.notes.report("camera_setting", f"the driver refuses {what} = {value:g}", what)

    def _automatic(self) -> None:
        self._set("automatic exposure", cv2.CAP_PROP_AUTO_EXPOSURE, _AUTOMATIC)
        self._set("automatic white balance", cv2.CAP_PROP_AUTO_WB, 1)

    def _apply(self, controls: Controls) -> None:
        """Set what is requested; while the automatics run, report what the driver says."""
        request = controls.take()
        if request is not None:
            self._exposure = request.exposure
            if request.exposure is None:
                self._automatic()
            else:
                self._fix(request.exposure)
        if controls.watched:
            controls.reported = self._reported()

    def _reported(self) -> Exposure | None:
        """What the driver says of the exposure, None if it does not say all of it."""
        keys = (
            cv2.CAP_PROP_EXPOSURE,
            cv2.CAP_PROP_GAIN,
            cv2.CAP_PROP_WHITE_BALANCE_RED_V,
            cv2.CAP_PROP_WHITE_BALANCE_BLUE_U,
        )
        units, gain, red, blue = (float(self._capture.get(key)) for key in keys)
        # OpenCV says -1 or 0 of what a driver does not have.
        if not (units > 0.0 and min(gain, red, blue) >= 0.0):
            return None
        exposure_us = units * _EXPOSURE_UNIT_US
        return Exposure(exposure_us=exposure_us, gain=gain, red_gain=red, blue_gain=blue)

    def read(self) -> Frame:
        if self.controls is not None:
            self._apply(self.controls)
        ok, image = self._capture.read()
        if not ok or image is None:
            raise SourceError(
                f"camera {self._table.name!r}: {self._device!r} delivers no more images; "
                "is it unplugged?"
            )
        frame = Frame(
            self._table.name,
            self._seq,
            self._stamp_ns(),
            0.0,
            (image.shape[1], image.shape[0]),
            image,
            "bgr",
        )
        self._seq += 1
        return frame

    def _stamp_ns(self) -> int:
        now_ns = clock.now_ns()
        half_exposure_ns = (
            0 if self._exposure is None else round(self._exposure.exposure_us * 500.0)
        )
        driver_ns = round(float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) * 1e6)
        age_ns = time.monotonic_ns() - driver_ns
        return now_ns - half_exposure_ns - (age_ns if 0 <= age_ns < _MAX_AGE_NS else 0)

    def close(self) -> None:
        if self._capture is not None:
            self._capture.release()
