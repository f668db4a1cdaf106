"""Any recording of poses as OpenVrPose messages; its kind is told by its content. Pure.

objects.jsonl    OpenVrPose lines, as in a capture
a folder         a capture with an objects.jsonl
libsurvive       .rec, .rec.gz, or what `survive-cli --record-stdout` printed
a table          triad_openvr's rows and console logs, OpenVR 3x4 rows, CSV files of poses
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Literal

from rhot.errors import CaptureError
from rhot.files.capture import Capture, read_lines
from rhot.messages.objects import OpenVrPose
from services.object_tracker.recorded.survive import read_survive
from services.object_tracker.recorded.tables import read_table
from services.object_tracker.recorded.text_lines import text_lines

Kind = Literal["messages", "libsurvive", "table"]
# Of a device that its recording does not name.
UNNAMED = "recorded"
# `0.002059 OPTION v i 100`, `0.003220 INFO LOG ...`, `28.3 WM0 POSE ...`
_SURVIVE = re.compile(r"\d+\.\d+ (OPTION|INFO|\S+ [A-Z][A-Za-z_]*) ")
# A recording of libsurvive's names itself in its first line, a table within its preamble.
_LOOK_AT = 100
_BINARY = {
    b"\x89MCAP0\r\n": "an MCAP recording: `rhot replay` plays it",
    b"\xd4\xc3\xb2\xa1": "raw USB traffic: `survive-cli --usbmon-playback` reads it",
}


def kind_of(path: Path) -> Kind:
    """What a file or folder is. Raises CaptureError if it is no known recording of poses."""
    file = _file(path)
    try:
        with file.open("rb") as raw:
            start = raw.read(8)
    except OSError as error:
        raise CaptureError(f"{file}: cannot be read: {error.strerror}") from None
    for magic, what in _BINARY.items():
        if start.startswith(magic):
            raise CaptureError(f"{file}: {what}")
    lines = [line for _, line in islice(text_lines(file), _LOOK_AT) if line.strip()]
    if lines and lines[0].lstrip().startswith("{"):
        return "messages"
    if any(_SURVIVE.match(line) for line in lines):
        return "libsurvive"
    try:
        next(read_table(file, UNNAMED))
    except CaptureError as error:
        raise CaptureError(
            f"{error}; a recording is an objects.jsonl, a capture's folder, a libsurvive recording"
            " or a table"
        ) from None
    return "table"


def read_poses(path: Path, serial: str = UNNAMED) -> Iterator[OpenVrPose]:
    """The poses of any known recording, in OpenVR's frame, in the order of the file.

    serial names the device of a table that names none. Messages keep their stamps; those of other
    kinds are nanoseconds since 1970 if the recording has dates (tables with a date or such times),
    else since its start. Raises CaptureError, with the line where one is wrong.
    """
    file = _file(path)
    match kind_of(path):
        case "messages":
            return read_lines(file, OpenVrPose)
        case "libsurvive":
            return read_survive(file)
        case "table":
            return read_table(file, serial)


def _file(path: Path) -> Path:
    if not path.is_dir():
        return path
    objects = Capture(path).objects
    if not objects.is_file():
        raise CaptureError(f"{path}: this folder has no {objects.name}: no capture with objects")
    return objects
