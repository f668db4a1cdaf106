"""A Raspberry Pi camera through picamera2: YUV420 frames at a fixed exposure.

Pictures are neither sharpened nor denoised (picamera2's defaults are both), and what the camera
reports is compared with that: one that does otherwise says which. YUV420 comes in limited range, as
asked for, or in full range where the camera says so.

FrameWallClock, on CLOCK_REALTIME, is the instant at which row 0 starts to be read out, the end of
its exposure; half the exposure before it is the stamp. SensorTimestamp counts from boot and is
never used. Without an exposure calibration the camera's auto modes stay on and the notes say so. A
missing package or camera, a system too old for FrameWallClock, and a camera that stops delivering
raise SourceError.

With sync in the [[camera]] table cameras of several Pis expose together (libcamera's software
synchronisation, picamera2 0.3.25 on). Frames are delivered before that is reached, too, with their
true stamps, and a camera that finds no partner says so once. Written from picamera2's sources and
tested against a stand-in; not tried on hardware.
"""

from __future__ import annotations

import importlib
from typing import Any

from rhot.errors import SourceError
from rhot.files.calibration import Exposure
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.controls import UNCALIBRATED, Controls
from services.pi_tracker.sources.notes import Notes
from services.pi_tracker.sources.picamera_settings import (
    AUTOMATIC,
    ControlCheck,
    best_sensor_mode,
    fixed_exposure,
    is_bt601,
    is_full_range,
    other_exposure,
    plain_picture,
    reported_exposure,
    sync_control,
    unpadded,
)

# Readout of one sensor line in the binned modes, measured: ov5647 (camera v1) 33.7 us, imx219 (v2)
# 18.9 us.
_LINE_US = {"ov5647": 33.7, "imx219": 18.9}
# The slowest exposure of a 10 fps camera is 100 ms; one that is silent for this long is gone.
_SILENCE_S = 2.0
# The server tells its clients the common instant some seconds ahead; who has not heard of one by
# then hears no server.
_SYNC_S = 15.0
# New values hold after three or four frames; what differs for this long is not on its way.
_SETTLE_S = 2.0
# A client moves its frames by stretching and shortening them: a sensor at its fastest cannot.
_MAX_SYNC_RATE = 0.97


class PiCamera:
    """Camera `number` of this Raspberry Pi."""

    live = True

    def __init__(self, table: CameraTable, number: int, exposure: Exposure | None) -> None:
        self.notes = Notes(table.name)
        self.controls = Controls()
        self._table = table
        self._number = number
        self._exposure = exposure
        self._camera: Any = None
        self._stride = 0
        self._size = table.size_px
        self._row_time_ns = 0.0
        self._seq = 0
        self._full_range = False
        self._sync_done = table.sync == "off"
        self._check = ControlCheck({}, table.fps)
        # Frames in a row with another exposure than was fixed.
        self._strays = 0

    def open(self) -> None:
        module = _picamera2()
        cameras = module.Picamera2.global_camera_info()
        if self._number >= len(cameras):
            names = [f"{index}: {info.get('Model', '?')}" for index, info in enumerate(cameras)]
            raise self._error(
                f"this machine has no camera {self._number}; it has {', '.join(names) or 'none'}. "
                "Check the ribbon cable and `rpicam-hello --list-cameras`"
            )
        try:
            self._camera = module.Picamera2(self._number)
            self._configure()
            self._camera.start()
            # Once more: what is set at the start is in no frame's metadata, what goes with a
            # request is in that frame's.
            self._camera.set_controls(self._check.wanted)
        except RuntimeError as error:
            raise self._error(f"cannot be started: {error}; does another program use it?") from None

    def _error(self, text: str) -> SourceError:
        return SourceError(f"camera {self._table.name!r}: {text}")

    def _configure(self) -> None:
        mode = best_sensor_mode(self._camera.sensor_modes, self._table)
        config = self._camera.create_video_configuration(
            main={"size": self._table.size_px, "format": "YUV420"},
            # BT.601 with Y in 16..235 at every size: the colour tables' convention.
            colour_space=importlib.import_module("libcamera").ColorSpace.Smpte170m(),
            sensor={"output_size": mode["size"], "bit_depth": mode["bit_depth"]} if mode else {},
            # No frame waits in a queue: each request is the next one to be exposed.
            queue=False,
            buffer_count=4,
            controls=self._initial_controls(),
        )
        self._camera.configure(config)
        if mode and self._table.sync != "off" and self._table.fps > _MAX_SYNC_RATE * mode["fps"]:
            text = f"fps = {self._table.fps:g} is the sensor's fastest; sync needs a lower one"
            self.notes.report("camera_unsynced", text, "fps")
        main = self._camera.camera_configuration()["main"]
        self._stride, self._size = int(main["stride"]), (int(main["size"][0]), int(main["size"][1]))
        if self._size != tuple(self._table.size_px):
            width, height = self._size
            text = f"delivers {width}x{height} instead of {self._table.size_px}"
            self.notes.report("camera_processing", text, "size")
        self._take_colour_space()
        line_us = _LINE_US.get(str(self._camera.camera_properties.get("Model", "")), 0.0)
        self._row_time_ns = line_us * 1000.0 * (mode["size"][1] / self._size[1] if mode else 1.0)
        if not line_us:
            text = "the sensor's readout time is unknown; rows count as taken at once"
            self.notes.report("camera_readout_unknown", text)

    def _take_colour_space(self) -> None:
        """What the pictures' numbers mean, as libcamera has set it."""
        # picamera2's own configuration() knows three colour spaces by their primaries, and says
        # "limited" of one that libcamera has changed to full range.
        space = self._camera.libcamera_config.at(0).color_space
        self._full_range = is_full_range(space)
        if not is_bt601(space):
            text = f"delivers colours of {space} instead of BT.601"
            self.notes.report("camera_processing", text, "colours")

    def _initial_controls(self) -> dict[str, Any]:
        frame_us = round(1e6 / self._table.fps)
        controls: dict[str, Any] = {"FrameDurationLimits": (frame_us, frame_us)}
        controls |= sync_control(self._table)
        plain = plain_picture()
        known = {name: plain[name] for name in plain if name in self._camera.camera_controls}
        self._check = ControlCheck(known, self._table.fps)
        if unknown := ", ".join(plain.keys() - known.keys()):
            text = f"has no control {unknown}: it may process its picture"
            self.notes.report("camera_processing", text, "controls")
        controls |= known
        if self._exposure is None:
            self.notes.report("camera_automatic", UNCALIBRATED)
            return controls
        return controls | fixed_exposure(self._exposure)

    def read(self) -> Frame:
        request = self.controls.take()
        if request is not None:
            self._exposure, self._strays = request.exposure, 0
            self._camera.set_controls(
                AUTOMATIC if request.exposure is None else fixed_exposure(request.exposure)
            )
            if request.exposure is not None:
                self.notes.clear("camera_automatic")
        try:
            completed = self._camera.capture_request(wait=False).get_result(timeout=_SILENCE_S)
        except TimeoutError:
            raise self._error(f"no image for {_SILENCE_S:g} s; is its cable loose?") from None
        try:
            metadata = completed.get_metadata()
            image = unpadded(completed.make_buffer("main"), self._size, self._stride)
        finally:
            completed.release()
        self.controls.reported = reported_exposure(metadata)
        self._check_sync(metadata)
        self._check_picture(metadata)
        frame = Frame(
            self._table.name,
            self._seq,
            self._stamp_ns(metadata),
            self._row_time_ns,
            self._size,
            image,
            "i420",
            self._full_range,
        )
        self._seq += 1
        return frame

    def _check_sync(self, metadata: dict[str, Any]) -> None:
        """Say that there is no partner, where a camera is to be in step with others."""
        if self._sync_done:
            return
        self._sync_done = bool(metadata.get("SyncReady"))
        if self._sync_done:
            self.notes.clear("camera_unsynced")
        elif self._seq >= _SYNC_S * self._table.fps:
            self.notes.report(
                "camera_unsynced",
                f"sync = {self._table.sync!r}, but not in step with any other after {_SYNC_S:g} s; "
                "is there one camera with the other role, at the same fps, in the same network?",
            )

    def _check_picture(self, metadata: dict[str, Any]) -> None:
        """Say what the camera does otherwise than asked: processing, exposure."""
        if not self._check.done:
            self._check.update(metadata)
            if self._check.problem:
                text = f"its picture is not left as it is: {self._check.problem}"
                self.notes.report("camera_processing", text)
        reported = self.controls.reported
        if self._exposure is None or reported is None:
            return
        problem = other_exposure(self._exposure, reported)
        if not problem and self._strays:
            self.notes.clear("camera_automatic")
        self._strays = self._strays + 1 if problem else 0
        if self._strays == round(_SETTLE_S * self._table.fps):
            self.notes.report("camera_automatic", f"does not hold its exposure: {problem}")

    def _stamp_ns(self, metadata: dict[str, Any]) -> int:
        wall_ns = metadata.get("FrameWallClock")
        if wall_ns is None:
            raise self._error(
                "libcamera gives no FrameWallClock; update with `sudo apt full-upgrade`"
            )
        return int(wall_ns) - round(float(metadata.get("ExposureTime", 0.0)) * 500.0)

    def close(self) -> None:
        if self._camera is not None:
            self._camera.close()
            self._camera = None


def _picamera2() -> Any:
    try:
        return importlib.import_module("picamera2")
    except ImportError as error:
        raise SourceError(
            f"picamera2 is not installed ({error}): run `sudo apt install python3-picamera2`, "
            "and make the virtual environment with --system-site-packages"
        ) from None
