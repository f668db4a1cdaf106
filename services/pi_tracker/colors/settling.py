"""Convergence of a camera's automatic exposure and white balance, from the values it reports.

Pure. The automatics run once, on the background the camera will see, and are then frozen: colour
ranges are worth nothing while the camera changes its exposure. A driver that reports nothing never
settles; the caller has a deadline.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from rhot.files.calibration import Exposure

# Automatics count as settled when nothing has changed by more than this for so long; picamera2's
# take one to two seconds to get there.
_MAX_CHANGE, _SETTLED_NS = 0.02, 1_000_000_000
# Fewer reports are no second of a camera.
_MIN_REPORTS = 5


class Settling:
    """Reports of a running automatic, one per image."""

    def __init__(self) -> None:
        self._reports: deque[tuple[int, Exposure]] = deque(maxlen=1024)

    def add(self, report: Exposure, stamp_ns: int) -> None:
        """What an image was taken with."""
        self._reports.append((stamp_ns, report))
        while (
            stamp_ns - self._reports[0][0] > _SETTLED_NS
            and stamp_ns - self._reports[1][0] >= _SETTLED_NS
        ):
            self._reports.popleft()

    def settled(self) -> Exposure | None:
        """The values, once they have not changed for a second."""
        if len(self._reports) < _MIN_REPORTS:
            return None
        if self._reports[-1][0] - self._reports[0][0] < _SETTLED_NS:
            return None
        values = np.array(
            [[r.exposure_us, r.gain, r.red_gain, r.blue_gain] for _, r in self._reports]
        )  # (n, 4)
        scale = np.maximum(np.abs(values).max(axis=0), 1e-9)
        if np.any(np.ptp(values, axis=0) > _MAX_CHANGE * scale):
            return None
        exposure_us, gain, red_gain, blue_gain = np.median(values, axis=0).tolist()
        return Exposure(
            exposure_us=round(exposure_us, 1),
            gain=round(gain, 4),
            red_gain=round(red_gain, 4),
            blue_gain=round(blue_gain, 4),
        )
