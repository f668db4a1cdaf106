"""Cameras that have moved since the calibration: their views do not fit any more, for seconds."""

from __future__ import annotations

import numpy as np

# Heights that differ by more than this are not a calibrated pair's (stereo RMS of real pairs is .22
# px; a bump of .2 deg is 1.8 px), ...
MOVED_PX = 1.5
# ... and if two in five of the last hundred observations (2 s of six markers) do, it is no wrong
# marker and no fast motion: a camera rolled by 3 deg moves four in six of a hand's markers that
# far. Once reported it stays so until four in five fit again.
_NEW, _SHARE_ON, _SHARE_OFF = 0.01, 0.4, 0.2
# Share of a new height in the running mean of those beyond MOVED_PX, and the most it counts.
_NEW_HEIGHT, _MAX_PX = 0.05, 1e3


class MovedCameraMonitor:
    """Running shares, per pair of cameras, of heights that differ by more than MOVED_PX."""

    def __init__(self, pairs: int) -> None:
        self._share = np.zeros(pairs)  # of observations beyond MOVED_PX
        self._mean_px = np.zeros(pairs)  # mean height of these
        self._moved = np.zeros(pairs, dtype=bool)

    def observe(self, pair: int, height_px: float) -> None:
        """Note one height difference of a pair, by its index."""
        beyond = height_px > MOVED_PX
        self._share[pair] += _NEW * (beyond - self._share[pair])
        if beyond:
            known_px = self._mean_px[pair]
            height_px = min(height_px, _MAX_PX)
            self._mean_px[pair] += _NEW_HEIGHT * (height_px - known_px) if known_px else height_px
        self._moved[pair] = self._share[pair] > (_SHARE_OFF if self._moved[pair] else _SHARE_ON)

    def height_px(self, pair: int) -> float | None:
        """By how much the views of a pair differ; None unless one of its cameras has moved."""
        return float(self._mean_px[pair]) if self._moved[pair] else None
