"""Which columns of a table of poses are what: from its header, else from how many there are. Pure.

What people keep poses in: rows of triad_openvr's get_pose_euler (x y z yaw pitch roll),
get_pose_quaternion (x y z w x y z) or get_pose_matrix (3x4, row by row), with or without a time
before them, and CSV files whose header says what is in them, of one device or of several side by
side.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

POSITION = ("x", "y", "z")
QUATERNION = ("qw", "qx", "qy", "qz")
ANGLES = ("yaw", "pitch", "roll")
MATRIX = tuple(f"m{row}{column}" for row in range(3) for column in range(4))
# By the number of columns, time not counted; the order is triad_openvr's.
_BY_COUNT = {6: POSITION + ANGLES, 7: POSITION + QUATERNION, 12: MATRIX}
# A quaternion printed with four decimals is a unit one within 1e-4; other four numbers seldom are.
_UNIT = 1e-3

_PLAIN = {
    "time": "time t timestamp time_stamp stamp seconds",
    "serial": "serial device tracker",
    "kind": "kind",
    "qx": "i",
    "qy": "j",
    "qz": "k",
}
_MEANING = {word: name for name, words in _PLAIN.items() for word in words.split()}
_UNITS = {"_s": 1.0, "_ms": 1e-3, "_us": 1e-6, "_ns": 1e-9, "_m": 1.0, "_mm": 1e-3, "_cm": 1e-2}
_PLACE = "p|pos|position|t|trans|translation|loc|location"
_TURN = "q|quat|quaternion|r|rot|rotation|ori|orientation"
_WHAT = (
    rf"(?:(?:(?P<place>{_PLACE})|(?P<turn>{_TURN}))_?)?(?P<axis>[wxyz])|(?P<angle>yaw|pitch|roll)"
)
# `x`, `pos_x`, `PositionX`, `vive_qw`; `x_vive`, `qw_vive`.
_FORMS = (
    re.compile(rf"(?:(?P<of>[a-z0-9_]+?)_)??(?:{_WHAT})\Z"),
    re.compile(rf"(?:{_WHAT})_(?P<of>[a-z0-9_]+)\Z"),
)


@dataclass(frozen=True)
class Columns:
    """names[i] is what column i holds (None: nothing of ours), scales[i] its unit in s or m.

    A time without a unit in its header has the scale 0: its size tells (time_scale). device is what
    the header calls the device, where it names several.
    """

    names: tuple[str | None, ...]
    scales: tuple[float, ...]
    device: str = ""

    def has(self, names: Sequence[str]) -> bool:
        return all(name in self.names for name in names)

    def scale(self, name: str) -> float:
        return self.scales[self.names.index(name)]


def columns_of_header(words: Sequence[str]) -> tuple[Columns, ...]:
    """The columns that a header names, of each device whose pose is whole; none if it is no header.

    In `x y z w j i k`, as somebody labelled rows of get_pose_quaternion, the order is that
    function's all the same: w x y z. So it is in `x y z w x y z`.
    """
    lower = [re.sub(r"[^a-z0-9]+", "_", word.lower()).strip("_") for word in words]
    if "3x4" in lower:
        return (Columns(MATRIX, (1.0,) * 12),)
    named = [_named(word) for word in lower]
    if "w" in lower and sorted(lower[lower.index("w") + 1 :][:3]) == ["i", "j", "k"]:
        start = lower.index("w")
        named[start : start + 4] = [("", name, 1.0) for name in QUATERNION]
    devices = dict.fromkeys(one[0] for one in named if one is not None and one[1] in POSITION)
    found = [_columns_of(device, named) for device in devices]
    whole = [
        columns
        for columns in found
        if columns.has(POSITION) and (columns.has(QUATERNION) or columns.has(ANGLES))
    ]
    return tuple(whole)


def columns_of_row(numbers: Sequence[float]) -> tuple[Columns, ...]:
    """The columns of a row without a header, by their number; none if no such table is known."""
    count = len(numbers)
    # Seven numbers are a position and a quaternion, or a time and six.
    if count == 7 and abs(math.hypot(*numbers[3:]) - 1.0) > _UNIT:
        names: tuple[str, ...] = ("time", *_BY_COUNT[6])
    elif count in _BY_COUNT:
        names = _BY_COUNT[count]
    elif count - 1 in _BY_COUNT:
        names = ("time", *_BY_COUNT[count - 1])
    else:
        return ()
    return (Columns(names, tuple(0.0 if name == "time" else 1.0 for name in names)),)


def time_scale(time: float) -> float:
    """Seconds in the unit of a time stamp without one, told by its size.

    From 1e17 on nanoseconds since 1970, from 1e14 micro-, from 1e11 milliseconds; below, seconds.
    """
    for least, scale in ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3)):
        if abs(time) >= least:
            return scale
    return 1.0


def _columns_of(device: str, named: Sequence[tuple[str, str, float] | None]) -> Columns:
    """One device's columns among all; a second x, y or z without a name is the quaternion's."""
    names: list[str | None] = []
    for one in named:
        name = None
        if one is not None and (one[0] == device or one[1] in ("time", "serial", "kind")):
            name = one[1]
            if name in POSITION and name in names:
                name = f"q{name}"
        names.append(name if name not in names else None)
    return Columns(tuple(names), tuple(1.0 if one is None else one[2] for one in named), device)


def _named(word: str) -> tuple[str, str, float] | None:
    """Whose column of a header this is ("" if it does not say), what it is, and its unit."""
    stem, scale = _unit_of(word)
    for text in (stem, word):
        if text in _MEANING:
            name = _MEANING[text]
            return "", name, (0.0 if name == "time" and text == word else scale)
    for form in _FORMS:
        if found := form.match(stem):
            of = found["of"] or ""
            if found["angle"]:
                return of, found["angle"], 1.0
            turn = found["turn"] is not None or (found["axis"] == "w" and not found["place"])
            return of, f"q{found['axis']}" if turn else found["axis"], scale
    return None


def _unit_of(word: str) -> tuple[str, float]:
    """A name without its unit, and the unit, as in `x_mm`."""
    for ending, scale in _UNITS.items():
        if word.endswith(ending) and len(word) > len(ending):
            return word.removesuffix(ending), scale
    return word, 1.0
