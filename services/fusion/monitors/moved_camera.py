"""Cameras that have moved since the calibration: their views do not fit any more, for seconds.

A moved camera shifts the height of each landmark by an amount of its own that lasts. What wanders
about nought is noise, however large (a detector's errors last for some frames), and what changes as
the hand moves is a wrong marker or a clock: neither is a moved camera.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

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


class MovedCameraMonitor:
    """The last seconds' heights of each landmark, per pair of cameras."""

    def __init__(self, pairs: int) -> None:
        # By landmark: time (s) and height (px).
        self._heights: list[dict[int, deque[tuple[float, float]]]] = [{} for _ in range(pairs)]
        self._moved_px: list[float | None] = [None] * pairs

    def observe(self, pair: int, time_s: float, heights_px: dict[int, float]) -> None:
        """Note the height differences of an instant by landmark, of a pair by its index."""
        known = self._heights[pair]
        for landmark, height_px in heights_px.items():
            limited = min(max(height_px, -_MAX_PX), _MAX_PX)
            known.setdefault(landmark, deque()).append((time_s, limited))
        for landmark, series in list(known.items()):
            while series and not 0.0 <= time_s - series[0][0] <= _SPAN_S:
                series.popleft()
            if not series:
                del known[landmark]
        enough = [
            np.array([height_px for _, height_px in series])
            for series in known.values()
            if len(series) >= _ENOUGH
        ]
        displaced = [px for px in map(displaced_px, enough) if px > 0.0]
        limit = _SHARE_ON if self._moved_px[pair] is None else _SHARE_OFF
        told = len(enough) > 0 and len(displaced) > limit * len(enough)
        self._moved_px[pair] = float(np.median(displaced)) if told else None

    def height_px(self, pair: int) -> float | None:
        """By how much the views of a pair differ; None unless one of its cameras has moved."""
        return self._moved_px[pair]


@njit(cache=True)
def displaced_px(heights: Array) -> float:
    """How far off a landmark's heights (n,) are, if that is more than chance; else 0."""
    median = np.median(heights)
    deviation = np.median(np.abs(heights - median))
    newest = np.median(heights[-_NEWEST:])
    least = max(MOVED_PX, _SIGMAS * _ERROR * deviation / math.sqrt(len(heights)))
    sign = np.sign(median)
    return abs(median) if min(median * sign, newest * sign) > least else 0.0
