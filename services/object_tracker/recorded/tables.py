"""Tables of poses: triad_openvr's rows and console logs, OpenVR 3x4 rows, CSV files. Pure.

Words are parted by commas, semicolons, white space or brackets. A line before the first row may
name the columns, a frequency (`Freq: 250`) and when the table began (`current Time:
2020-08-27-14:49:22`, taken as UTC since it has no zone). A row `None` is a pose that SteamVR called
invalid.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.messages.objects import OpenVrPose
from services.object_tracker.recorded.columns import (
    ANGLES,
    MATRIX,
    POSITION,
    QUATERNION,
    Columns,
    time_scale,
)
from services.object_tracker.recorded.euler import rotation_from_triad_angles
from services.object_tracker.recorded.messages import UNIVERSE, recorded_pose
from services.object_tracker.recorded.preamble import Preamble, number_of, row_words, words_of
from services.object_tracker.recorded.text_lines import text_lines
from services.object_tracker.survive_lines import R_LIGHTHOUSE_FROM_SURVIVE

KNOWN_ROWS = (
    "known rows, with or without a time before them: x y z yaw pitch roll, x y z w x y z,"
    " a 3x4 matrix; or columns named by a header"
)
_SERIAL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")
# libsurvive's words for a pose: what they stand beside is z-up.
_SURVIVE_KINDS = ("POSE", "EXTERNAL_POSE")
# What a library says while it starts, a header, the devices found.
_LONGEST_PREAMBLE = 100
# A quaternion whose length is off by more than this is no rotation (near 180 deg triad_openvr
# divides noise by noise: 4 w).
_UNIT_TOLERANCE = 1e-3
# Year 2255: what a stamp in nanoseconds can hold; a later time, or none at all, becomes 0.
_LATEST_S = 9e9


def read_table(path: Path, serial: str) -> Iterator[OpenVrPose]:
    """The poses of a table, in OpenVR's frame; `serial` is for rows that name no device.

    Stamps are the time column's, else the beginning plus row / frequency (250 Hz where none is
    told). Numbers that cannot be a pose give an invalid one. Raises CaptureError with its number
    for a line that is no row, unless it is the last: who stopped the logger cut it off.
    """
    rows = _Rows(path, serial)
    wrong: CaptureError | None = None
    for number, line in text_lines(path):
        if wrong is not None:
            raise wrong
        if not line.strip() or (not rows.begun and not rows.begin(number, line)):
            continue
        poses = rows.poses(line)
        if not poses:
            wrong = _no_row(path, number, line)
        yield from poses
    if rows.count == 0:
        raise CaptureError(f"{path}: no poses in it; {KNOWN_ROWS}")


def _no_row(path: Path, number: int, line: str) -> CaptureError:
    return CaptureError(f"{path}: line {number}: not a pose: {line[:60]!r}; {KNOWN_ROWS}")


class _Rows:
    """Turns the rows of one table into poses."""

    def __init__(self, path: Path, serial: str) -> None:
        self._path = path
        self._preamble = Preamble(serial)
        self._texts = False
        self._time_scale = 0.0
        self._seq = 0
        self.begun = False
        self.count = 0

    def begin(self, number: int, line: str) -> bool:
        """Takes a line of the preamble; whether it is the first row already.

        Raises CaptureError after too many lines without a row or a header.
        """
        first = self._preamble.read(line)
        columns = self._preamble.columns
        if columns:
            self.begun = True
            self._texts = columns[0].has(("serial",)) or columns[0].has(("kind",))
        elif number >= _LONGEST_PREAMBLE:
            raise _no_row(self._path, number, line)
        return first

    def poses(self, line: str) -> list[OpenVrPose]:
        """The poses of one row, one for each device in it; none if the line is no row."""
        words = words_of(line)
        row = words if self._texts else row_words(words)
        if not self._texts and len(words) - len(row) == 2 and _SERIAL.match(words[0]):
            # `LHR-1 Quaternion x y z ...`, as the UDP sender made of triad_openvr prints it.
            self._preamble.serial = words[0]
        if row == [] and words[-1:] == ["None"]:
            stamp_ns = self._stamp_ns(self._preamble.columns[0], {}, {})
            found = [recorded_pose(self._preamble.serial, self._seq, stamp_ns, None)]
        else:
            several = len(self._preamble.columns) > 1
            made = [self._pose(columns, row, several) for columns in self._preamble.columns]
            found = [pose for pose in made if pose is not None]
        self.count += bool(found)
        self._seq += len(found)
        return found

    def _pose(self, columns: Columns, row: list[str], several: bool) -> OpenVrPose | None:
        """One device's pose in a row, None if it is none."""
        if len(row) == len(columns.names) + 1 and row[-1] == "":
            row = row[:-1]
        if len(row) != len(columns.names):
            return None
        cells = {n: word for n, word in zip(columns.names, row, strict=True) if n is not None}
        numbers: dict[str, float] = {}
        for name, word in cells.items():
            if name not in ("serial", "kind"):
                # An empty cell is a sample that is missing.
                value = number_of(word or "nan")
                if value is None:
                    return None
                numbers[name] = value
        named = columns.device if several and columns.device else self._preamble.serial
        serial = cells.get("serial", named)
        if not _SERIAL.match(serial):
            return None
        survive = cells.get("kind") in _SURVIVE_KINDS
        return recorded_pose(
            serial,
            self._seq,
            self._stamp_ns(columns, cells, numbers),
            _transform(columns, numbers, survive),
            "libsurvive" if survive else UNIVERSE,
        )

    def _stamp_ns(self, columns: Columns, cells: dict[str, str], numbers: dict[str, float]) -> int:
        if "time" not in cells:
            return round((self._preamble.began_s + self.count / self._preamble.rate_hz) * 1e9)
        time = numbers["time"]
        if self._time_scale == 0.0:
            scale = columns.scale("time")
            self._time_scale = scale if scale else time_scale(time)
        if not abs(time * self._time_scale) < _LATEST_S:
            return 0
        # Decimal: float64 holds nanoseconds since 1970 to a quarter of a microsecond only.
        return round(Decimal(cells["time"]) * round(self._time_scale * 1e9))


def _transform(columns: Columns, numbers: dict[str, float], survive: bool) -> Array | None:
    """T_lighthouse_from_tracker (3, 4); None if these numbers are no rotation."""
    if columns.has(MATRIX):
        return np.array([numbers[name] for name in MATRIX]).reshape(3, 4)
    position = np.array([numbers[name] * columns.scale(name) for name in POSITION])
    rotation: Array | None
    if columns.has(QUATERNION):
        quaternion = np.array([numbers[name] for name in QUATERNION])
        unit = abs(float(np.sqrt(quaternion @ quaternion)) - 1.0) <= _UNIT_TOLERANCE
        rotation = rotation_from_quaternion(quaternion) if unit else None
    else:
        rotation = rotation_from_triad_angles(*(numbers[name] for name in ANGLES))
    if rotation is None:
        return None
    T = np.column_stack([rotation, position])
    return R_LIGHTHOUSE_FROM_SURVIVE @ T if survive else T
