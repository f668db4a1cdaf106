"""How landmarks' distances from the cameras lately changed: how far they may have got meanwhile.

A hand that waves changes its distance by decimetres a second, one whose fingers play on a table by
millimetres. What two cameras saw of a landmark's last seconds tells which it is, and so how unsure
its distance is once one camera alone sees it. Compiled; nothing here raises.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools

# For how long speeds are remembered, and the range that a distance keeps to, s.
_SPEED_MEMORY_S, _RANGE_MEMORY_S = 0.5, 2.0
# One sigma grows by this many times the RMS speed, and ends at so many standard deviations of the
# distance: two values of a range differ by sqrt(2) of them, but by up to twice that where a hand
# sways and is at the other end of its way. Chosen on the tuning half of benchmarks/one_camera.py,
# all markers hidden from one camera, RMS and NEES for .3 s and for 1 s: with 1 times the speed 22.9
# mm, 2.8 and 38.1, 1.7; with 1.5 22.9, 2.6 and 38.2, 1.6; with 2 23.2, 2.6 and 38.4, 1.6; as fast
# for every hand (.35 m/s, to .12 m) 24.9, 2.6 and 42.4, 1.4. While it ended at 1.4 deviations and
# .12 m, points were the same, and tips of swaying hands' poses 35, 40, 47, 71 and 38 mm off for 28,
# 35, 44, 60 and 30 (tuning half of benchmarks/one_camera_poses.py, over a second): where the hand
# sways, its bones tell the distance better than its last sight.
_TIMES_SPEED, _TIMES_RANGE = 1.5, 2.0
# A hand that rested may set off, and one that is fast is not lost at once: least and most.
_RATE_M_S, _FARTHEST_M = (0.05, 1.0), (0.02, 0.3)
# Taken for granted before anything is learnt: speed and standard deviation.
_FIRST_M_S, _FIRST_M = 0.15, 0.035
# Instants that are farther apart than so many are not of one motion.
_GAP_SPANS = 3.5


class DistanceMotion(NamedTuple):
    """Of L landmarks, from instants at which two cameras saw them."""

    time_s: Array  # (L,) the last instant; -inf before the first
    distance_m: Array  # (L,) then
    squared_speed: Array  # (L,) m^2/s^2, running mean
    mean_m: Array  # (L,) running mean of the distance
    variance_m2: Array  # (L,) about it


def no_motion(landmarks: int) -> DistanceMotion:
    """Nothing seen yet."""
    return DistanceMotion(
        np.full(landmarks, -np.inf),
        np.zeros(landmarks),
        np.full(landmarks, _FIRST_M_S**2),
        np.zeros(landmarks),
        np.full(landmarks, _FIRST_M**2),
    )


@njit(cache=True, error_model="numpy")
def learn_motion(
    motion: DistanceMotion, located: Bools, places: Array, eye: Array, time_s: float, span_s: float
) -> None:
    """Take in an instant about span_s after the last one: places (L, 3) of those located (L,).

    eye (3,): the middle of the cameras.
    """
    for k in np.flatnonzero(located):
        distance_m = math.sqrt(np.sum((places[k] - eye) ** 2))
        elapsed_s = time_s - motion.time_s[k]
        if 0.0 < elapsed_s <= _GAP_SPANS * span_s:
            speed = (distance_m - motion.distance_m[k]) / elapsed_s
            new = 1.0 - math.exp(-elapsed_s / _SPEED_MEMORY_S)
            motion.squared_speed[k] += new * (speed**2 - motion.squared_speed[k])
            new = 1.0 - math.exp(-elapsed_s / _RANGE_MEMORY_S)
            off_m = distance_m - motion.mean_m[k]
            motion.mean_m[k] += new * off_m
            motion.variance_m2[k] += new * (off_m**2 - motion.variance_m2[k])
        elif not 0.0 < elapsed_s < _RANGE_MEMORY_S:
            motion.mean_m[k] = distance_m
        motion.time_s[k], motion.distance_m[k] = time_s, distance_m


def moved_sigma_m(motion: DistanceMotion, landmark: int, age_s: float) -> float:
    """How far a landmark's distance may be from what it was, 1 sigma, so long after."""
    (slow, fast), (near_m, far_m) = _RATE_M_S, _FARTHEST_M
    rate = max(_TIMES_SPEED * math.sqrt(motion.squared_speed[landmark]), slow)
    range_m = max(_TIMES_RANGE * math.sqrt(motion.variance_m2[landmark]), near_m)
    return min(min(rate, fast) * age_s, range_m, far_m)
