"""Cameras that have moved since the calibration: their views do not fit any more, for seconds.

A moved camera shifts the height of each landmark by an amount of its own that lasts. What wanders
about nought is noise, however large (a detector's errors last for some frames), and what changes as
the hand moves is a wrong marker or a clock: neither is a moved camera.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints

# Heights that differ by more than this are not a calibrated pair's (stereo RMS of real pairs is .22
# px; a bump of .2 deg is 1.8 px), ...
MOVED_PX = 1.5
# ... and if two in five landmarks do so over the last seconds, it is no wrong marker: a camera
# rolled by 3 deg moves four in six of a hand's markers that far. Once reported it stays so until
# four in five fit again.
_SHARE_ON, _SHARE_OFF = 0.4, 0.2
# How long is looked back, and how many heights of a landmark are enough: half of two seconds.
_SPAN_S, _ENOUGH = 2.0, 10
# A landmark's median height counts if it is this many of its standard errors: 1.25 * 1.48 times the
# median deviation, as of a quarter as many independent values (errors correlated by .7 from frame
# to frame and a hand's motion last for some of these ten a second).
_SIGMAS, _ERROR = 3.0, 1.25 * 1.48 * 2.0
# The median of so many of the newest heights must say the same: what is over is over.
_NEWEST = 5
_MAX_PX = 1e3
# Heights of a landmark that are kept: ten a second are half as many.
_KEPT = 40


class _Series(NamedTuple):
    """The last seconds' heights of each of L landmarks, the oldest first."""

    times_s: Array  # (L, _KEPT)
    heights_px: Array  # (L, _KEPT)
    counts: Ints  # (L,) how many there are


class MovedCameraMonitor:
    """The last seconds' heights of each landmark, per pair of cameras."""

    def __init__(self, pairs: int, landmarks: int) -> None:
        each = landmarks, _KEPT
        self._series = [
            _Series(np.empty(each), np.empty(each), np.zeros(landmarks, dtype=np.int64))
            for _ in range(pairs)
        ]
        self._moved_px: list[float | None] = [None] * pairs

    def observe(self, pair: int, time_s: float, landmarks: Ints, heights_px: Array) -> None:
        """Note the height differences (n,) of landmarks (n,) at an instant, of a pair by index."""
        enough, displaced, median_px = _displaced(self._series[pair], time_s, landmarks, heights_px)
        limit = _SHARE_ON if self._moved_px[pair] is None else _SHARE_OFF
        told = enough > 0 and displaced > limit * enough
        self._moved_px[pair] = median_px if told else None

    def height_px(self, pair: int) -> float | None:
        """By how much the views of a pair differ; None unless one of its cameras has moved."""
        return self._moved_px[pair]


@njit(cache=True)
def _displaced(
    series: _Series, time_s: float, landmarks: Ints, heights_px: Array
) -> tuple[int, int, float]:
    """Take in an instant: of how many landmarks enough is known, how many are displaced, and by how
    much, the median of those.
    """
    for i in range(landmarks.size):
        _note(series, landmarks[i], time_s, min(max(heights_px[i], -_MAX_PX), _MAX_PX))
    enough, count, found = 0, 0, np.empty(series.counts.size)
    for k in range(series.counts.size):
        _forget(series, k, time_s)
        if series.counts[k] >= _ENOUGH:
            enough += 1
            off_px = _displaced_px(series.heights_px[k, : series.counts[k]])
            if off_px > 0.0:
                found[count] = off_px
                count += 1
    return enough, count, np.median(found[:count]) if count else 0.0


@njit(cache=True)
def _note(series: _Series, landmark: int, time_s: float, height_px: float) -> None:
    """Append a height; the oldest makes room for it."""
    times_s, heights_px = series.times_s[landmark], series.heights_px[landmark]
    if series.counts[landmark] == _KEPT:
        times_s[:-1] = times_s[1:].copy()
        heights_px[:-1] = heights_px[1:].copy()
        series.counts[landmark] -= 1
    times_s[series.counts[landmark]] = time_s
    heights_px[series.counts[landmark]] = height_px
    series.counts[landmark] += 1


@njit(cache=True)
def _forget(series: _Series, landmark: int, time_s: float) -> None:
    """Leave out what is over, and what was before time went back."""
    times_s, heights_px = series.times_s[landmark], series.heights_px[landmark]
    count, over = series.counts[landmark], 0
    while over < count and not 0.0 <= time_s - times_s[over] <= _SPAN_S:
        over += 1
    for i in range(over, count):
        times_s[i - over], heights_px[i - over] = times_s[i], heights_px[i]
    series.counts[landmark] = count - over


@njit(cache=True)
def _displaced_px(heights: Array) -> float:
    """How far off a landmark's heights (n,) are, if that is more than chance; else 0."""
    median = np.median(heights)
    deviation = np.median(np.abs(heights - median))
    newest = np.median(heights[-_NEWEST:])
    least = max(MOVED_PX, _SIGMAS * _ERROR * deviation / math.sqrt(len(heights)))
    sign = np.sign(median)
    return abs(median) if min(median * sign, newest * sign) > least else 0.0
