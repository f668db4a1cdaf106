"""FABRIK in a digit's plane of bending: passes, starts and restarts.

Backward from the target, forward from the root with every hinge limited on both sides, then the
last two flexions drawn to their coupling.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.finger.bending_plane import BendingPlane, clamp_angle, planar_tip

# Passes of one start: FABRIK arrives in about 6 passes, or hangs.
_MAX_PASSES_PER_START = 40
# A start whose distance after 8 more passes is above this share of what it was hangs.
_STALL_RATIO, _STALL_PASSES = 0.9, 8
# Share of each flexion's range in the postures that a hanging chain starts again from.
_RESTART_POSTURES = (0.5, 0.2, 0.8)


@njit(cache=True)
def reach_in_plane(
    plane: BendingPlane,
    flexions: Array,
    target: tuple[float, float],
    max_passes: int,
    tolerance: float,
) -> int:
    """Flexions (3,), in and out, that bring the tip to target (forward, palmar); returns passes.

    From where the digit is, then from other postures, then from the best of them without the
    coupling.
    """
    best, least, used = flexions.copy(), np.inf, 0
    trial = np.empty(3)
    has_coupling = plane.coupling[1] > 0.0
    for attempt in range(5):
        if attempt == 0 or attempt == 4:
            trial[:] = best
        else:
            for j in range(3):
                low, high = plane.limits[j + 1, 0], plane.limits[j + 1, 1]
                trial[j] = low + _RESTART_POSTURES[attempt - 1] * (high - low)
        coupled = has_coupling and attempt < 4
        left, passes = _one_start(plane, trial, target, coupled, max_passes - used, tolerance)
        used += passes
        if left < least:
            best[:], least = trial, left
        if least <= tolerance or used >= max_passes:
            break
    flexions[:] = best
    return used


@njit(cache=True)
def _one_start(
    plane: BendingPlane,
    flexions: Array,
    target: tuple[float, float],
    coupled: bool,
    max_passes: int,
    tolerance: float,
) -> tuple[float, int]:
    """Passes until the tip is there or hangs; the best flexions (3,) are kept.

    Returns (distance left, passes).
    """
    best, least, least_before, used = flexions.copy(), np.inf, np.inf, 0
    while used < min(max_passes, _MAX_PASSES_PER_START):
        left = _one_pass(plane, flexions, target, coupled)
        used += 1
        if left < least:
            best[:], least = flexions, left
        if least <= tolerance:
            break
        if used % _STALL_PASSES == 0:
            if least > _STALL_RATIO * least_before:
                break
            least_before = least
    flexions[:] = best
    return least, used


@njit(cache=True)
def _one_pass(
    plane: BendingPlane, flexions: Array, target: tuple[float, float], coupled: bool
) -> float:
    """One backward and one forward pass; flexions (3,) in and out; returns the distance left.

    RHOT eq. (6)-(8): from the target back along the old joints, then from the root with limits.
    """
    a, b, c = plane.bones
    limits = plane.limits
    forward, palmar = target
    x1, y1 = a * math.cos(flexions[0]), a * math.sin(flexions[0])
    angle2 = flexions[0] + flexions[1]
    x2, y2 = x1 + b * math.cos(angle2), y1 + b * math.sin(angle2)
    # Backward: where the DIP and PIP joints would be if the tip were there.
    gap = max(math.hypot(x2 - forward, y2 - palmar), 1e-12)
    x2, y2 = forward + c * (x2 - forward) / gap, palmar + c * (y2 - palmar) / gap
    gap = max(math.hypot(x1 - x2, y1 - y2), 1e-12)
    x1, y1 = x2 + b * (x1 - x2) / gap, y2 + b * (y1 - y2) / gap
    # Forward: each bone points at the next joint as far as its hinge allows.
    first = clamp_angle(math.atan2(y1, x1), limits[1, 0], limits[1, 1])
    x1, y1 = a * math.cos(first), a * math.sin(first)
    second = clamp_angle(math.atan2(y2 - y1, x2 - x1) - first, limits[2, 0], limits[2, 1])
    x2, y2 = x1 + b * math.cos(first + second), y1 + b * math.sin(first + second)
    last = math.atan2(palmar - y2, forward - x2) - first - second - plane.gamma
    last = clamp_angle(last, limits[3, 0], limits[3, 1])
    if coupled:
        ratio = plane.coupling[0]
        second = min(max((second + ratio * last) / (1.0 + ratio**2), limits[2, 0]), limits[2, 1])
        last = min(max(ratio * second, limits[3, 0]), limits[3, 1])
        # The root turns the whole chain onto the target again.
        x, y = planar_tip(plane, first, second, last)
        first = first + math.atan2(palmar, forward) - math.atan2(y, x)
        first = clamp_angle(first, limits[1, 0], limits[1, 1])
    flexions[0], flexions[1], flexions[2] = first, second, last
    x, y = planar_tip(plane, first, second, last)
    return math.hypot(x - forward, y - palmar)
