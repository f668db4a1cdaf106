"""Frame sources: one interface for cameras, files and the simulator, chosen by a word in rig.toml.

    picamera2, picamera2:1     a Raspberry Pi's camera
    v4l2:0, v4l2:/dev/video0   a USB camera
    gstreamer:PIPELINE         whatever OpenCV's GStreamer can read
    video:FILE  folder:DIR  capture:DIR     files; relative paths start at rig.toml's folder
    simulator                  the simulated rig on the bus

READERS is the table of them; docs/extend.md shows how to add one. A word that is none of these is a
ConfigError with the list. A source that cannot be opened says so
when it is opened, not here.
"""

from __future__ import annotations

import cv2

from rhot.bus.bus import Bus
from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from services.pi_tracker.sources.capture import CaptureReader
from services.pi_tracker.sources.folder import FolderReader
from services.pi_tracker.sources.kinds import Request, SourceKind
from services.pi_tracker.sources.picamera import PiCamera
from services.pi_tracker.sources.reader import Reader, Source
from services.pi_tracker.sources.simulator import SimulatorSource
from services.pi_tracker.sources.threaded import ThreadedSource
from services.pi_tracker.sources.v4l2 import OpenCvCamera
from services.pi_tracker.sources.video import VideoReader

__all__ = ["READERS", "Reader", "Request", "Source", "SourceKind", "open_reader", "open_source"]


def _v4l2(request: Request) -> Reader:
    device = int(request.rest) if request.rest.isdigit() else request.rest
    return OpenCvCamera(request.table, device, request.exposure)


READERS: dict[str, SourceKind] = {
    "picamera2": SourceKind(
        "picamera2, picamera2:N",
        lambda request: PiCamera(request.table, int(request.rest or 0), request.exposure),
        lambda rest: not rest or rest.isdigit(),
    ),
    "v4l2": SourceKind("v4l2:N, v4l2:/dev/...", _v4l2),
    "gstreamer": SourceKind(
        "gstreamer:PIPELINE",
        lambda request: OpenCvCamera(request.table, request.rest, None, cv2.CAP_GSTREAMER),
    ),
    "video": SourceKind(
        "video:FILE",
        lambda one: VideoReader(one.table.name, one.path, one.table.fps, one.start_ns or 0),
        is_file=True,
    ),
    "folder": SourceKind(
        "folder:DIR",
        lambda one: FolderReader(one.table.name, one.path, one.table.fps, one.start_ns or 0),
        is_file=True,
    ),
    "capture": SourceKind(
        "capture:DIR",
        lambda one: CaptureReader(one.table.name, one.path, one.start_ns),
        is_file=True,
    ),
}


def open_source(table: CameraTable, config: RigConfig, bus: Bus, start_ns: int = 0) -> Source:
    """The source of a camera for its service.

    Files play in real time, their first frame stamped start_ns.
    """
    if table.source == "simulator":
        return SimulatorSource(bus, table.name)
    return ThreadedSource(open_reader(table, config, start_ns), real_time=True)


def is_file(table: CameraTable) -> bool:
    """Whether the source is a recording, which begins with the session and ends."""
    kind = READERS.get(table.source.partition(":")[0])
    return kind is not None and kind.is_file


def open_reader(table: CameraTable, config: RigConfig, start_ns: int | None = None) -> Reader:
    """The blocking reader of a camera's source, not opened yet.

    start_ns None keeps a capture's own stamps (others start at 0). Raises ConfigError for an
    unknown form, and for the simulator, which is no file: write a capture with `rhot simulate`.
    """
    name, _, rest = table.source.partition(":")
    kind = READERS.get(name)
    if kind is None or not kind.takes(rest):
        valid = ", ".join([*(one.forms for one in READERS.values()), "simulator"])
        raise ConfigError(f"camera {table.name!r}: unknown source {table.source!r}; valid: {valid}")
    return kind.make(Request(config, table, rest, start_ns))
