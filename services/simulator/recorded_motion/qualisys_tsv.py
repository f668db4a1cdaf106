"""Optical motion capture of a glove, as Qualisys exports it: TSV, millimetres, one row a frame.

Above the table stand lines such as `FREQUENCY 100`; its header begins with `Frame`, `Time` and has
`<marker> X`, Y, Z. Tips are `<digit>_tip`; the glove's back carries hand_top, hand_left and
hand_right, of which the latter two are next to the wrist. Its markers are on a glove, not at
joints: no bones fit them. Cells are empty or zero where a marker was hidden. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.hand import TIPS
from services.simulator.recorded_motion.recording import RecordedPoints, usable_rows

# The wrist is the middle of these two.
_WRIST = ("hand_left", "hand_right")
# On the back of the glove: what tells a right hand from a left one.
_BACK = "hand_top"


def is_qualisys(header: str) -> bool:
    """Whether a file's first line is that of such a recording."""
    return header.startswith("NO_OF_FRAMES")


def read_qualisys(lines: Iterable[str], name: str) -> RecordedPoints:
    """Wrist and tips. Raises CaptureError naming the markers that are missing or the bad line."""
    rows = [line.rstrip("\r\n").split("\t") for line in lines]
    start = next((k for k, row in enumerate(rows) if row[:2] == ["Frame", "Time"]), None)
    if start is None:
        raise CaptureError(f"{name}: has no line that begins with Frame, Time and names markers")
    head = rows[start]
    missing = [n for n in (*_WRIST, _BACK, *TIPS) if f"{n} X" not in head]
    if missing:
        raise CaptureError(
            f"{name}: has no marker {', '.join(missing)}; needed are"
            f" {', '.join((*_WRIST, _BACK, *TIPS))}"
        )
    columns = [head.index(f"{n} X") for n in (*_WRIST, _BACK, *TIPS)]
    times_s, points = _numbers(rows[start + 1 :], start + 2, columns, name)
    keep = usable_rows(times_s, name)
    left, right, back = points[keep, 0], points[keep, 1], points[keep, 2]
    landmarks = np.concatenate([0.5 * (left + right)[:, None], points[keep, 3:]], axis=1)
    return RecordedPoints(
        hand="right" if _is_right(landmarks, back) else "left",
        times_s=times_s[keep] - times_s[keep[0]],
        points_m=landmarks,
    )


def _numbers(
    rows: list[list[str]], first_line: int, columns: list[int], name: str
) -> tuple[Array, Array]:
    """Times (n,) in s and markers (n, m, 3) in m, NaN where hidden."""
    times_s, points = np.empty(len(rows)), np.full((len(rows), len(columns), 3), np.nan)
    for k, row in enumerate(rows):
        try:
            times_s[k] = float(row[1])
            for m, column in enumerate(columns):
                cells = row[column : column + 3]
                if len(cells) == 3 and all(cells):
                    points[k, m] = [float(cell) for cell in cells]
        except (IndexError, ValueError):
            raise CaptureError(
                f"{name}: line {first_line + k}: expected a frame's number, its time and markers"
            ) from None
    points[(points == 0.0).all(axis=2)] = np.nan
    return times_s, points * 1e-3


def _is_right(landmarks: Array, back: Array) -> bool:
    """Whether the back of the hand, its fingers and its thumb's side go round as a right hand's."""
    wrist, _, index, _, _, little = np.nanmean(landmarks, axis=0)
    out = np.nanmean(back - landmarks[:, 0], axis=0)
    return bool(np.dot(np.cross(out, 0.5 * (index + little) - wrist), index - little) > 0.0)
