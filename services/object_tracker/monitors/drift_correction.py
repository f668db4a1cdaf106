"""A small rigid correction of the registration, for `[objects] drift = "correct"`. Pure.

It follows what the watch found, slowly, so that objects do not jump in the hand, and never far:
what has moved farther is to be registered again. It is kept in memory only.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import (
    Array,
    apply,
    inverse,
    rotation_from_vector,
    transform,
    vector_from_rotation,
)
from services.object_tracker.monitors.drift_fit import DriftFit

# A second: finger tips are known to 2 mm, and a hand that holds a cup moves faster than this.
_RATE_M, _RATE_RAD = 0.002, np.deg2rad(0.1)
# A bumped base station; one that was put elsewhere is farther.
MOST_M, MOST_RAD = 0.03, np.deg2rad(2.0)


class DriftCorrection:
    """T_rig_from_before (4, 4) is what is put before T_rig_from_lighthouse now."""

    def __init__(self) -> None:
        self.T_rig_from_before: Array = np.eye(4)
        self._wanted: Array = np.eye(4)
        self._middle_m: Array = np.zeros(3)

    def want(self, fit: DriftFit | None) -> bool:
        """Follow a fit from now on, or none at all; false, and nothing changes, if it is too
        far.
        """
        if fit is None:
            self._wanted = np.eye(4)
            return True
        if fit.distance_m > MOST_M or float(np.linalg.norm(fit.turn_rad)) > MOST_RAD:
            return False
        self._wanted, self._middle_m = fit.T_rig_from_before, fit.middle_m
        return True

    def follow(self, elapsed_s: float) -> None:
        """Go on towards what is wanted."""
        left = self._wanted @ inverse(self.T_rig_from_before)
        turn = vector_from_rotation(left[:3, :3])
        shift = apply(left, self._middle_m) - self._middle_m
        share = min(
            1.0,
            elapsed_s * _RATE_M / max(float(np.linalg.norm(shift)), 1e-9),
            elapsed_s * _RATE_RAD / max(float(np.linalg.norm(turn)), 1e-9),
        )
        R = rotation_from_vector(share * turn)
        step = transform(R, self._middle_m + share * shift - R @ self._middle_m)
        self.T_rig_from_before = step @ self.T_rig_from_before

    @property
    def distance_m(self) -> float:
        """How far it moves the middle of what was seen."""
        return float(np.linalg.norm(apply(self.T_rig_from_before, self._middle_m) - self._middle_m))
