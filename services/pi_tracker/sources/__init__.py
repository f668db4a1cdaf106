"""Frame sources: one interface for cameras, files and the simulator, chosen by a word in rig.toml.

    picamera2, picamera2:1     a Raspberry Pi's camera
    v4l2:0, v4l2:/dev/video0   a USB camera
    gstreamer:PIPELINE         whatever OpenCV's GStreamer can read
    video:FILE  folder:DIR  capture:DIR     files; relative paths start at rig.toml's folder
    simulator                  the simulated rig on the bus

A word that is none of these is a ConfigError with the list. A source that cannot be opened says so
when it is opened, not here.
"""

from __future__ import annotations

from pathlib import Path

import cv2

from rhot.bus.bus import Bus
from rhot.errors import ConfigError
from rhot.files.calibration import Exposure, load_exposure
from rhot.files.config import CameraTable, RigConfig
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.picamera import PiCamera
from services.pi_tracker.sources.reader import Reader, Source
from services.pi_tracker.sources.simulator import SimulatorSource
from services.pi_tracker.sources.threaded import ThreadedSource
from services.pi_tracker.sources.v4l2 import OpenCvCamera
from services.pi_tracker.sources.video import VideoReader

__all__ = ["Reader", "Source", "ThreadedSource", "open_reader", "open_source"]

FORMS = (
    "picamera2, picamera2:N, v4l2:N, v4l2:/dev/..., gstreamer:PIPELINE, "
    "video:FILE, folder:DIR, capture:DIR, simulator"
)


def open_source(table: CameraTable, config: RigConfig, bus: Bus, start_ns: int = 0) -> Source:
    """The source of a camera for its service.

    Files play in real time, their first frame stamped start_ns.
    """
    if table.source == "simulator":
        return SimulatorSource(bus, table.name)
    return ThreadedSource(open_reader(table, config, start_ns), real_time=True)


def is_file(table: CameraTable) -> bool:
    """Whether the source is a recording, which begins with the session and ends."""
    return table.source.partition(":")[0] in ("video", "folder", "capture")


def open_reader(table: CameraTable, config: RigConfig, start_ns: int | None = None) -> Reader:
    """The blocking reader of a camera's source, not opened yet.

    start_ns None keeps a capture's own stamps (others start at 0). Raises ConfigError for an
    unknown form, and for the simulator, which is no file: write a capture with `rhot simulate`.
    """
    kind, _, rest = table.source.partition(":")
    path = Path(config.folder) / Path(rest).expanduser()
    match kind, bool(rest):
        case "video", True:
            return VideoReader(table.name, path, table.fps, start_ns or 0)
        case "folder", True:
            return FolderReader(table.name, path, table.fps, start_ns or 0)
        case "capture", True:
            return CaptureReader(table.name, path, start_ns)
        case "picamera2", _ if not rest or rest.isdigit():
            return PiCamera(table, int(rest or 0), _exposure(config, table.name))
        case "v4l2", True:
            device = int(rest) if rest.isdigit() else rest
            return OpenCvCamera(table, device, _exposure(config, table.name))
        case "gstreamer", True:
            return OpenCvCamera(table, rest, None, cv2.CAP_GSTREAMER)
    raise ConfigError(f"camera {table.name!r}: unknown source {table.source!r}; valid: {FORMS}")


def _exposure(config: RigConfig, camera: str) -> Exposure | None:
    """The exposure calibration, or None before there is one: it is made with the camera running."""
    exists = (config.calibration_dir / f"{camera}.exposure.json").exists()
    return load_exposure(config.calibration_dir, camera) if exists else None
