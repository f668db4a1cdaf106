"""Which recording of a hand a file is: Leap CSV, Qualisys TSV, truth.jsonl, poses.jsonl; .gz too.

What is no such recording is a CaptureError that says what it is instead, and what is valid.
"""

from __future__ import annotations

import gzip
import io
import zlib
from pathlib import Path

from rhot.errors import CaptureError
from services.simulator.recorded_motion.leap_csv import is_leap, read_leap
from services.simulator.recorded_motion.qualisys_tsv import is_qualisys, read_qualisys
from services.simulator.recorded_motion.recording import RecordedJoints, RecordedPoints
from services.simulator.recorded_motion.rhot_lines import read_rhot

_VALID = (
    "valid: a Leap recording (.csv with timestamp_us), a Qualisys export (.tsv, .tsv.gz),"
    " truth.jsonl or poses.jsonl of rhot, or a folder with one of the latter two"
)
_IN_FOLDERS = ("truth.jsonl", "poses.jsonl")
_GZIP = b"\x1f\x8b"


def load_recording(path: Path) -> RecordedJoints | RecordedPoints:
    """The recording at path. Raises CaptureError."""
    if path.is_dir():
        found = [path / name for name in _IN_FOLDERS if (path / name).is_file()]
        if not found:
            raise CaptureError(f"{path}: has neither {' nor '.join(_IN_FOLDERS)}; {_VALID}")
        path = found[0]
    lines = _text(path).splitlines()
    header = lines[0].strip() if lines else ""
    if header.startswith("{"):
        return read_rhot(path, header.encode())
    if is_leap(header):
        return read_leap(lines, str(path))
    if is_qualisys(header):
        return read_qualisys(lines, str(path))
    begins = f"it begins with {header[:40]!r}" if header else "it is empty"
    raise CaptureError(f"{path}: is no recording of a hand: {begins}; {_VALID}")


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
        if data[:2] == _GZIP:
            data = gzip.GzipFile(fileobj=io.BytesIO(data)).read()
        return data.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error) as error:
        raise CaptureError(f"{path}: cannot be read: {error}; {_VALID}") from None
    except UnicodeDecodeError:
        raise CaptureError(f"{path}: is no text; {_VALID}") from None
