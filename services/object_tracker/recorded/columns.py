"""Which column of a table of poses is what: from its header, else from how many there are. Pure.

What people keep poses in: rows of triad_openvr's get_pose_euler (x y z yaw pitch roll),
get_pose_quaternion (x y z w x y z) or get_pose_matrix (3x4, row by row), with or without a time
before them, and CSV files whose header says what is in them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

_NAMES = {
    "time": "time t timestamp stamp seconds",
    "x": "x px pos_x position_x tx",
    "y": "y py pos_y position_y ty",
    "z": "z pz pos_z position_z tz",
    "qw": "qw w r_w rw q_w quat_w rot_w",
    "qx": "qx i r_x rx q_x quat_x rot_x",
    "qy": "qy j r_y ry q_y quat_y rot_y",
    "qz": "qz k r_z rz q_z quat_z rot_z",
    "yaw": "yaw",
    "pitch": "pitch",
    "roll": "roll",
    "serial": "serial device tracker",
    "kind": "kind",
}
_MEANING = {word: name for name, words in _NAMES.items() for word in words.split()}
_UNITS = {"_s": 1.0, "_ms": 1e-3, "_us": 1e-6, "_ns": 1e-9, "_m": 1.0, "_mm": 1e-3, "_cm": 1e-2}
POSITION = ("x", "y", "z")
QUATERNION = ("qw", "qx", "qy", "qz")
ANGLES = ("yaw", "pitch", "roll")
MATRIX = tuple(f"m{row}{column}" for row in range(3) for column in range(4))
# By the number of columns, time not counted; the order is triad_openvr's.
_BY_COUNT = {6: POSITION + ANGLES, 7: POSITION + QUATERNION, 12: MATRIX}
# A quaternion printed with four decimals is a unit one within 1e-4; other four numbers seldom are.
_UNIT = 1e-3


@dataclass(frozen=True)
class Columns:
    """names[i] is what column i holds (None: nothing of ours), scales[i] its unit in s or m.

    A time without a unit in its header has the scale 0: its size tells (time_scale).
    """

    names: tuple[str | None, ...]
    scales: tuple[float, ...]

    def has(self, names: Sequence[str]) -> bool:
        return all(name in self.names for name in names)

    def scale(self, name: str) -> float:
        return self.scales[self.names.index(name)]


def columns_of_header(words: Sequence[str]) -> Columns | None:
    """The columns that a header names, None if it names no pose.

    In `x y z w j i k`, as somebody labelled rows of get_pose_quaternion, the order is that
    function's all the same: w x y z. So it is in `x y z w x y z`.
    """
    lower = [word.strip().lower() for word in words]
    if "3x4" in lower:
        return Columns(MATRIX, (1.0,) * 12)
    names: list[str | None] = []
    scales: list[float] = []
    for word in lower:
        stem, scale = _unit_of(word)
        name = _MEANING.get(stem) or _MEANING.get(word)
        if name in POSITION and name in names:
            name = f"q{name}"
        names.append(name if name not in names else None)
        scales.append(0.0 if name == "time" and stem == word else scale)
    if "w" in lower and sorted(lower[lower.index("w") + 1 :][:3]) == ["i", "j", "k"]:
        start = lower.index("w")
        names[start : start + 4] = QUATERNION
    columns = Columns(tuple(names), tuple(scales))
    whole = columns.has(POSITION) and (columns.has(QUATERNION) or columns.has(ANGLES))
    return columns if whole else None


def columns_of_row(numbers: Sequence[float]) -> Columns | None:
    """The columns of a row without a header, by their number; None if no such table is known."""
    count = len(numbers)
    # Seven numbers are a position and a quaternion, or a time and six.
    if count == 7 and abs(math.hypot(*numbers[3:]) - 1.0) > _UNIT:
        names: tuple[str, ...] = ("time", *_BY_COUNT[6])
    elif count in _BY_COUNT:
        names = _BY_COUNT[count]
    elif count - 1 in _BY_COUNT:
        names = ("time", *_BY_COUNT[count - 1])
    else:
        return None
    return Columns(names, tuple(0.0 if name == "time" else 1.0 for name in names))


def time_scale(time: float) -> float:
    """Seconds in the unit of a time stamp without one, told by its size.

    From 1e17 on nanoseconds since 1970, from 1e14 micro-, from 1e11 milliseconds; below, seconds.
    """
    for least, scale in ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3)):
        if abs(time) >= least:
            return scale
    return 1.0


def _unit_of(word: str) -> tuple[str, float]:
    """A name without its unit, and the unit, as in `x_mm`."""
    for ending, scale in _UNITS.items():
        if word.endswith(ending) and len(word) > len(ending):
            return word.removesuffix(ending), scale
    return word, 1.0
