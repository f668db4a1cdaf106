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
        pose = rows.pose(line)
        if pose is None:
            wrong = _no_row(path, number, line)
        else:
            yield pose
    if rows.count == 0:
        raise CaptureError(f"{path}: no poses in it; {KNOWN_ROWS}")


def _no_row(path: Path, number: int, line: str) -> CaptureError:
    return CaptureError(f"{path}: line {number}: not a pose: {line[:60]!r}; {KNOWN_ROWS}")


class _Rows:
    """Turns the rows of one table into poses."""

    def __init__(self, path: Path, serial: str) -> None:
        self._path = path
        self._preamble = Preamble(serial)
        self._columns = Columns((), ())
        self._texts = False
        self._time_scale = 0.0
        self.begun = False
        self.count = 0

    def begin(self, number: int, line: str) -> bool:
        """Takes a line of the preamble; whether it is the first row already.

        Raises CaptureError after too many lines without a row or a header.
        """
        first = self._preamble.read(line)
        columns = self._preamble.columns
        if columns is not None:
            self.begun = True
            self._columns = columns
            self._texts = columns.has(("serial",)) or columns.has(("kind",))
        elif number >= _LONGEST_PREAMBLE:
            raise _no_row(self._path, number, line)
        return first

    def pose(self, line: str) -> OpenVrPose | None:
        """The pose of one row, None if the line is no row."""
        words = words_of(line)
        row = words if self._texts else row_words(words)
        if row == [] and words[-1] == "None":
            cells: dict[str, str] = {}
        elif len(row) == len(self._columns.names):
            cells = {n: w for n, w in zip(self._columns.names, row, strict=True) if n is not None}
        else:
            return None
        values = {
            name: number_of(word) for name, word in cells.items() if name not in ("serial", "kind")
        }
        if None in values.values():
            return None
        numbers = {name: value or 0.0 for name, value in values.items()}
        serial = cells.get("serial", self._preamble.serial)
        if not self._texts and len(words) - len(row) == 2 and _SERIAL.match(words[0]):
            # `LHR-1 Quaternion x y z ...`, as the UDP sender made of triad_openvr prints it.
            serial = words[0]
        if not _SERIAL.match(serial):
            return None
        survive = cells.get("kind") in _SURVIVE_KINDS
        T = self._transform(numbers, survive) if numbers else None
        pose = recorded_pose(
            serial,
            self.count,
            self._stamp_ns(cells.get("time"), numbers),
            T,
            "libsurvive" if survive else UNIVERSE,
        )
        self.count += 1
        return pose

    def _stamp_ns(self, text: str | None, numbers: dict[str, float]) -> int:
        if text is None:
            return round((self._preamble.began_s + self.count / self._preamble.rate_hz) * 1e9)
        time = numbers["time"]
        if self._time_scale == 0.0:
            scale = self._columns.scale("time")
            self._time_scale = scale if scale else time_scale(time)
        if not abs(time * self._time_scale) < _LATEST_S:
            return 0
        # Decimal: float64 holds nanoseconds since 1970 to a quarter of a microsecond only.
        return round(Decimal(text) * round(self._time_scale * 1e9))

    def _transform(self, numbers: dict[str, float], survive: bool) -> Array | None:
        """T_lighthouse_from_tracker (3, 4); None if these numbers are no rotation."""
        if self._columns.has(MATRIX):
            return np.array([numbers[name] for name in MATRIX]).reshape(3, 4)
        position = np.array([numbers[name] * self._columns.scale(name) for name in POSITION])
        rotation: Array | None
        if self._columns.has(QUATERNION):
            quaternion = np.array([numbers[name] for name in QUATERNION])
            unit = abs(float(np.sqrt(quaternion @ quaternion)) - 1.0) <= _UNIT_TOLERANCE
            rotation = rotation_from_quaternion(quaternion) if unit else None
        else:
            rotation = rotation_from_triad_angles(*(numbers[name] for name in ANGLES))
        if rotation is None:
            return None
        T = np.column_stack([rotation, position])
        return R_LIGHTHOUSE_FROM_SURVIVE @ T if survive else T
