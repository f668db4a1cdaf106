"""Recordings of a Leap Motion sensor as CSV: one row a frame and hand, millimetres, microseconds.

Columns: `timestamp_us`, `hand_type`, palm centre `palm_*`, the palm's true axes `normal_*` (out of
the palm) and `direction_*` (palm to fingers), and `<digit>_<mcp|pip|dip|tip>_*` of five digits. Of
the thumb `mcp` is the CMC joint, `pip` the MCP and `dip` the interphalangeal one. (`r00..r22`, the
sensor's own matrix between frames, is not the palm's basis: it is 18 deg off.) Pure.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterable

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, HANDS
from services.simulator.recorded_motion.recording import RecordedJoints, usable_rows

_DIGITS = {name: "pinky" if name == "little" else name for name in DIGITS}
_JOINTS = ("mcp", "pip", "dip", "tip")
_POINTS = (
    "palm",
    "normal",
    "direction",
    *(f"{digit}_{joint}" for digit in _DIGITS.values() for joint in _JOINTS),
)
COLUMNS = (
    "timestamp_us",
    "hand_type",
    *(f"{point}_{axis}" for point in _POINTS for axis in "xyz"),
)


def is_leap(header: str) -> bool:
    """Whether a file's first line is that of such a recording, complete or not."""
    return "timestamp_us" in header.split(",")


def read_leap(lines: Iterable[str], name: str) -> RecordedJoints:
    """The hand with most rows. Raises CaptureError naming the missing columns or the bad line."""
    reader = csv.DictReader(lines)
    missing = [column for column in COLUMNS if column not in (reader.fieldnames or ())]
    if missing:
        raise CaptureError(
            f"{name}: a Leap recording without {', '.join(missing[:4])}"
            f"{' and others' if len(missing) > 4 else ''}; it needs timestamp_us, hand_type,"
            " palm_x, normal_x, direction_x and mcp, pip, dip, tip of each digit (thumb_mcp_x, ...)"
        )
    rows = list(enumerate(reader, start=2))
    kinds = Counter(row["hand_type"] for _, row in rows if row["hand_type"] in HANDS)
    if not kinds:
        raise CaptureError(f"{name}: has no row whose hand_type is one of {', '.join(HANDS)}")
    hand = kinds.most_common(1)[0][0]
    table = _numbers([entry for entry in rows if entry[1]["hand_type"] == hand], name)
    keep = usable_rows(table[:, 0] * 1e-6, name)
    points = table[:, 1:].reshape(len(table), len(_POINTS), 3)[keep]
    normal, direction = points[:, 1], points[:, 2]
    times_s = table[keep, 0] * 1e-6
    return RecordedJoints(
        hand=hand,
        times_s=times_s - times_s[0],
        joints_m=points[:, 3:].reshape(-1, 5, 4, 3) * 1e-3,
        origin_m=points[:, 0] * 1e-3,
        axes=palm_axes(normal, direction),
        is_wrist=False,
    )


def palm_axes(normal: Array, direction: Array) -> Array:
    """Columns x, y, z of a hand (n, 3, 3) from what points out of its palm and along it; (n, 3)."""
    z = -direction / np.linalg.norm(direction, axis=1, keepdims=True)
    x = np.cross(-normal, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)


def _numbers(rows: list[tuple[int, dict[str, str]]], name: str) -> Array:
    """The timestamp and all points of rows (line, cells); (n, 1 + 3 * points)."""
    columns = [column for column in COLUMNS if column != "hand_type"]
    table = np.empty((len(rows), len(columns)))
    for k, (line, row) in enumerate(rows):
        try:
            table[k] = [float(row[column]) for column in columns]
        except (TypeError, ValueError):
            table[k] = np.nan
        if not np.isfinite(table[k]).all():
            raise CaptureError(f"{name}: line {line}: a cell is missing or is no number")
    return table
