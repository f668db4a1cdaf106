"""Height differences between two cameras over a whole recording, as rows of a regression.

At each sample of either camera, the other's height by a cubic through its four neighbours. What
that misses where a hand turns sharply is told by how far a quintic through six is from it: such
rows would pass for exact otherwise, and outweigh the rest. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.offset_search import HeightTrack, interpolated
from services.fusion.arrays import Ints
from services.fusion.monitors.shift_regression import Heights

# Samples a second of each camera that become rows, and instants a second that they are counted in.
_ROWS_HZ, INSTANTS_HZ = 30.0, 10.0
# What a cubic misses, as a multiple of its distance from a quintic.
_MISSED = 8.0
# Least noise of a height (.05 px at 500 px of focal length).
_NOISE = 1e-4
# Neighbours of a sample whose distances differ by more than this share do not give its speed.
_UNEVEN = 0.1


class Rows(NamedTuple):
    """n height differences; own: the height itself (n,), about its landmark's median."""

    heights: Heights
    own: Array


def rows_of(pairs: list[tuple[HeightTrack, HeightTrack]]) -> Rows | None:
    """The rows of each landmark's two tracks, by one clock; None without any."""
    begin_s = min(float(track.times_s[0]) for pair in pairs for track in pair)
    tables = []
    for row, (one, other) in enumerate(pairs):
        for sampled, there, sign in ((one, other, 1.0), (other, one, -1.0)):
            tables.append(_table(sampled, there, sign, begin_s, row))
    instants, landmarks, heights, speeds, spans, missed, own = np.concatenate(tables, axis=1)
    if not len(instants):
        return None
    rows = landmarks.astype(np.int64)
    variances = _noise(rows, heights) ** 2 + (_MISSED * missed) ** 2
    order = np.argsort(instants, kind="stable")
    zeros, ones = np.zeros(len(order)), np.ones(len(order))
    found = Heights(instants.astype(np.int64), rows, heights, zeros, speeds, spans, variances, ones)
    return Rows(take(found, order), own[order])


def take(rows: Heights, which: slice | Ints) -> Heights:
    """Some rows."""
    return Heights._make(column[which] for column in rows)


def _table(
    sampled: HeightTrack, there: HeightTrack, sign: float, begin_s: float, row: int
) -> Array:
    """Columns of rows_of (7, n) at one camera's samples."""
    times, heights = sampled.times_s, sampled.heights
    every = max(1, round(1.0 / (_ROWS_HZ * float(np.median(np.diff(times))))))
    k = np.arange(1, len(times) - 1, every)
    span = times[k + 1] - times[k - 1]
    even = np.abs(times[k + 1] + times[k - 1] - 2.0 * times[k]) <= _UNEVEN * span
    cubic, inside = interpolated(there, times[k])
    quintic, further = interpolated(there, times[k], 6)
    kept = even & inside & further
    columns = [
        np.round((times[k] - begin_s) * INSTANTS_HZ),
        np.full(len(k), row),
        sign * (heights[k] - cubic),
        (heights[k + 1] - heights[k - 1]) / span,
        span,
        quintic - cubic,
        heights[k] - np.median(heights),
    ]
    return np.stack(columns)[:, kept]


def _noise(landmarks: Array, heights: Array) -> float:
    """The noise of height differences, from what is left about each landmark's median."""
    left = []
    for landmark in np.unique(landmarks).tolist():
        own = heights[landmarks == landmark]
        left.append(np.abs(own - np.median(own)))
    return max(1.48 * float(np.median(np.concatenate(left))), _NOISE)
