"""What a hand has shown so far while it is used, message by message: told at once, between two
estimates that take seconds. Pure.
"""

from __future__ import annotations

import numpy as np

from rhot.hand import BASIC_LANDMARKS, TIPS
from rhot.messages import HandPoints
from services.calibrator.hand.free_motion.frames import MAX_STEP_S, fingers_held

# How often distances are kept: 20 a second tell whether a finger was bent, at any rate of cameras.
_EVERY_S = 0.05


class SeenSoFar:
    """seconds is for how long wrist and all tips were seen together, messages how many came.

    missing are landmarks that the newest message does not show.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self.messages = 0
        self.missing: tuple[str, ...] = ()
        self._before_ns: int | None = None
        self._kept_ns = 0
        self._reach: list[list[float]] = []

    def add(self, message: HandPoints) -> None:
        """One message more."""
        points = {one.name: one.position_m for one in message.points if one.source == "measured"}
        whole = not self.missing and self.messages > 0
        self.missing = tuple(name for name in BASIC_LANDMARKS if name not in points)
        self.messages += 1
        if self._before_ns is not None and whole:
            step_s = 1e-9 * (message.stamp_ns - self._before_ns)
            self.seconds += min(max(step_s, 0.0), MAX_STEP_S)
        self._before_ns = message.stamp_ns
        if not self.missing and abs(message.stamp_ns - self._kept_ns) >= 1e9 * _EVERY_S:
            self._kept_ns = message.stamp_ns
            wrist = np.array(points["wrist"])
            reach = [float(np.linalg.norm(np.array(points[tip]) - wrist)) for tip in TIPS]
            if np.all(np.isfinite(reach)):
                self._reach.append(reach)

    def not_bent(self) -> tuple[str, ...]:
        """Fingers that were not bent yet; all of them before anything was seen."""
        if not self._reach:
            return tuple(tip.removesuffix("_tip") for tip in TIPS[1:])
        return fingers_held(np.array(self._reach))
