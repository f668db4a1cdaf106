"""Height differences between two cameras over a whole recording, or some seconds of one, as rows
of a regression.

At each sample of either camera, the other's height by a cubic through its four neighbours. What
that misses where a hand turns sharply is told by how far a quintic through six is from it: such
rows would pass for exact otherwise, and outweigh the rest. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.height_track import HeightTrack, interpolated
from services.fusion.arrays import Ints
from services.fusion.monitors.shift_regression import Heights

# Samples a second of each camera that become rows, and instants a second that they are counted in.
ROWS_HZ, INSTANTS_HZ = 30.0, 10.0
# What a cubic misses, as a multiple of its distance from a quintic.
_MISSED = 8.0
# Least noise of a height (.05 px at 500 px of focal length).
_NOISE = 1e-4
# Neighbours of a sample whose distances differ by more than this share do not give its speed.
_UNEVEN = 0.1
# Stamps from the network may stand still or run back: no time between two is taken to be less.
_LEAST_S = 1e-6
# A spike differs by so many median deviations of its neighbours and so much more (6 px at 500 px
# of focal length): sharp turns of fast hands at 30 fps stay below half of that.
_SPIKE_SPREADS, _SPIKE = 4.0, 0.012


class Rows(NamedTuple):
    """n height differences; own: the height itself (n,), about its landmark's median.

    missed: what interpolation misses in the middle between two samples (n,), wherever the row lies.
    """

    heights: Heights
    own: Array
    missed: Array


def rows_of(pairs: list[tuple[HeightTrack, HeightTrack]], rows_hz: float = ROWS_HZ) -> Rows | None:
    """The rows of each landmark's two tracks, by one clock; None without any."""
    begin_s = min(float(track.times_s[0]) for pair in pairs for track in pair)
    tables = []
    for row, (one, other) in enumerate(pairs):
        for sampled, there, sign in ((one, other, 1.0), (other, one, -1.0)):
            tables.append(_table(sampled, there, sign, begin_s, row, rows_hz))
    table = np.concatenate(tables, axis=1)
    instants, landmarks, heights, speeds, spans, missed, own, between = table
    if not len(instants):
        return None
    rows = landmarks.astype(np.int64)
    variances = _noise(rows, heights) ** 2 + (_MISSED * missed) ** 2
    order = np.argsort(instants, kind="stable")
    zeros, ones = np.zeros(len(order)), np.ones(len(order))
    found = Heights(instants.astype(np.int64), rows, heights, zeros, speeds, spans, variances, ones)
    return Rows(take(found, order), own[order], _MISSED * between[order])


def without_spikes(track: HeightTrack) -> HeightTrack:
    """A track without the samples that are something else for a frame or two.

    They differ from the median of five by far more than the others do: a marker that turns sharply
    takes its neighbours along.
    """
    heights = track.heights
    if len(heights) < 5:
        return track
    five = np.lib.stride_tricks.sliding_window_view(np.pad(heights, 2, mode="edge"), 5)
    middle = np.median(five, axis=1)
    spread = np.median(np.abs(five - middle[:, None]), axis=1)
    kept = np.abs(heights - middle) <= _SPIKE_SPREADS * spread + _SPIKE
    return HeightTrack(track.times_s[kept], heights[kept])


def take(rows: Heights, which: slice | Ints) -> Heights:
    """Some rows."""
    return Heights._make(column[which] for column in rows)


def _table(
    sampled: HeightTrack, there: HeightTrack, sign: float, begin_s: float, row: int, rows_hz: float
) -> Array:
    """Columns of rows_of (8, n) at one camera's samples."""
    times, heights = sampled.times_s, sampled.heights
    period_s = max(float(np.median(np.diff(times))), _LEAST_S)
    every = max(1, round(1.0 / (rows_hz * period_s)))
    k = np.arange(1, len(times) - 1, every)
    span = np.maximum(times[k + 1] - times[k - 1], _LEAST_S)
    even = np.abs(times[k + 1] + times[k - 1] - 2.0 * times[k]) <= _UNEVEN * span
    cubic, inside = interpolated(there, times[k])
    quintic, further = interpolated(there, times[k], 6)
    after = np.clip(
        np.searchsorted(there.times_s, times[k], side="right"), 1, len(there.times_s) - 1
    )
    middle_s = 0.5 * (there.times_s[after - 1] + there.times_s[after])
    # Polynomials through samples of one instant are infinite, or NaN.
    with np.errstate(invalid="ignore"):
        missed = quintic - cubic
        between = np.abs(interpolated(there, middle_s, 6)[0] - interpolated(there, middle_s)[0])
    kept = even & inside & further & np.isfinite(missed) & np.isfinite(between)
    columns = [
        np.round((times[k] - begin_s) * INSTANTS_HZ),
        np.full(len(k), row),
        sign * (heights[k] - cubic),
        (heights[k + 1] - heights[k - 1]) / span,
        span,
        missed,
        heights[k] - np.median(heights),
        between,
    ]
    return np.stack(columns)[:, kept]


def _noise(landmarks: Array, heights: Array) -> float:
    """The noise of height differences, from what is left about each landmark's median."""
    left = []
    for landmark in np.unique(landmarks).tolist():
        own = heights[landmarks == landmark]
        left.append(np.abs(own - np.median(own)))
    return max(1.48 * float(np.median(np.concatenate(left))), _NOISE)
