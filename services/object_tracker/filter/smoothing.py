"""Takes the jitter from a tracker that rests, and lets none lag behind by more than a leash.

Pure. A low pass at 0.5 Hz follows the poses; where it would stay behind by more than the leash it
is dragged along at its length. So what rests is smooth, and what moves is late by the leash and no
more, whatever its speed and whatever the rate of its poses.
"""

from __future__ import annotations

import math

from rhot.geometry.quaternions import Quat, conjugate, from_vector, multiply, normalized, to_vector
from rhot.messages import Vec3

# On vive/libsurvive's still tracker (first half) 0.3, 0.5, 1, 2 and 5 Hz leave 25, 36, 54, 70 and
# 86 % of the jitter, and the second half agrees: benchmarks/objects_tracking.py. Slower ones take
# longer than a second until a tracker that was put down stands still.
_CUTOFF_HZ = 0.5
# The leash of turns for a leash of one metre: trackers are noisy by 1 mm and by 0.2 deg.
_RAD_PER_M = 3.5


class Smoother:
    """One tracker's smoothed pose."""

    def __init__(self, leash_m: float) -> None:
        self._leash_m, self._leash_rad = leash_m, leash_m * _RAD_PER_M
        self._stamp_ns = 0
        self._position_m: Vec3 = (math.inf, 0.0, 0.0)
        self._orientation: Quat = (1.0, 0.0, 0.0, 0.0)

    def take(self, stamp_ns: int, position_m: Vec3, orientation: Quat) -> tuple[Vec3, Quat]:
        """The smoothed position and orientation with this pose; stamps rise."""
        dt = max(0.0, (stamp_ns - self._stamp_ns) * 1e-9)
        keep = math.exp(-2.0 * math.pi * _CUTOFF_HZ * dt)
        self._stamp_ns = stamp_ns
        (x, y, z), (sx, sy, sz) = position_m, self._position_m
        dx, dy, dz = x - sx, y - sy, z - sz
        behind = math.sqrt(dx * dx + dy * dy + dz * dz)
        if not behind < math.inf:
            self._position_m, self._orientation = position_m, orientation
            return position_m, orientation
        share = _kept(behind, keep, self._leash_m)
        self._position_m = (x - dx * share, y - dy * share, z - dz * share)
        turn = to_vector(multiply(orientation, conjugate(self._orientation)))
        share = _kept(math.hypot(*turn), keep, self._leash_rad)
        back = from_vector(-turn[0] * share, -turn[1] * share, -turn[2] * share)
        self._orientation = normalized(multiply(back, orientation))
        return self._position_m, self._orientation


def _kept(behind: float, keep: float, leash: float) -> float:
    """The share of the way to the new pose that is left behind."""
    return keep if behind * keep <= leash else leash / behind
