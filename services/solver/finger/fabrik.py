"""FABRIK for one digit: forward and backward reaching (Aristidou & Lasenby 2011) with the joints'
limits, and ways out of its traps.

The chain is a rotor (abduction and first flexion, rotor.py) and two hinges that share its plane, so
the plane is turned onto the target first and the joints are placed in it: backward from the target,
forward from the root with every hinge limited on both sides, then the last two flexions drawn to
their coupling. Everything happens in the digit's canonical frame: turning the world changes nothing
(the seed's framework depends on it). FABRIK with limits alone sticks at nearly half of random
reachable targets, and a target on the line of a straight chain never bends it: a chain that no
longer comes nearer starts again from other postures, then without the coupling, then hands over to
damped least squares. A target beyond reach gives UNREACHABLE and a digit that points at it; one
that is not finite leaves the angles alone.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.finger import dls
from services.solver.finger.bending_plane import Plane, facing, forward_of, limited, plane_of
from services.solver.finger.dls import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.finger.swing_limits import BOX, swing
from services.solver.maths.kinematics import Chain, distance_to, length_of, reach_of, scaled
from services.solver.whole_hand.posture_prior import clamp

# Passes of one start: FABRIK arrives in about 6 passes, or hangs.
_PASSES = 40
# A start whose distance after 8 more passes is above this share of what it was hangs.
_GAIN, _WATCH = 0.9, 8
# Share of each flexion's range in the postures that a hanging chain starts again from.
_AGAIN = (0.5, 0.2, 0.8)


@njit(cache=True)
def _pass(plane: Plane, flexions: Array, forward: float, palm: float, joined: bool) -> float:
    """One backward and one forward pass in the plane; flexions (3,) in and out; returns the
    distance left.

    RHOT eq. (6)-(8): from the target back along the old joints, then from the root with limits.
    """
    a, b, c = plane.bones
    x1, y1 = a * math.cos(flexions[0]), a * math.sin(flexions[0])
    second = flexions[0] + flexions[1]
    x2, y2 = x1 + b * math.cos(second), y1 + b * math.sin(second)
    # Backward: where the DIP and PIP joints would be if the tip were there.
    gap = max(math.hypot(x2 - forward, y2 - palm), 1e-12)
    x2, y2 = forward + c * (x2 - forward) / gap, palm + c * (y2 - palm) / gap
    gap = max(math.hypot(x1 - x2, y1 - y2), 1e-12)
    x1, y1 = x2 + b * (x1 - x2) / gap, y2 + b * (y1 - y2) / gap
    # Forward: each bone looks at the next joint as far as its hinge allows.
    limits = plane.limits
    first = limited(math.atan2(y1, x1), limits[1, 0], limits[1, 1])
    x1, y1 = a * math.cos(first), a * math.sin(first)
    bend = limited(math.atan2(y2 - y1, x2 - x1) - first, limits[2, 0], limits[2, 1])
    x2, y2 = x1 + b * math.cos(first + bend), y1 + b * math.sin(first + bend)
    last = limited(
        math.atan2(palm - y2, forward - x2) - first - bend - plane.gamma, limits[3, 0], limits[3, 1]
    )
    if joined:
        ratio = plane.coupling[0]
        bend = min(max((bend + ratio * last) / (1.0 + ratio**2), limits[2, 0]), limits[2, 1])
        last = min(max(ratio * bend, limits[3, 0]), limits[3, 1])
        x, y = _tip(plane, first, bend, last)
        # The root turns the whole chain onto the target again.
        first = limited(
            first + math.atan2(palm, forward) - math.atan2(y, x), limits[1, 0], limits[1, 1]
        )
    flexions[0], flexions[1], flexions[2] = first, bend, last
    x, y = _tip(plane, first, bend, last)
    return math.hypot(x - forward, y - palm)


@njit(cache=True)
def _tip(plane: Plane, first: float, bend: float, last: float) -> tuple[float, float]:
    """Forward and palm of the painted point."""
    a, b, c = plane.bones
    second, third = first + bend, first + bend + last + plane.gamma
    x = a * math.cos(first) + b * math.cos(second) + c * math.cos(third)
    return x, a * math.sin(first) + b * math.sin(second) + c * math.sin(third)


@njit(cache=True)
def _one_start(
    plane: Plane,
    flexions: Array,
    forward: float,
    palm: float,
    joined: bool,
    most: int,
    tolerance: float,
) -> tuple[float, int]:
    """Passes until the tip is there or hangs; the best flexions (3,) are kept.

    Returns (distance left, passes).
    """
    best, least, watched, used = flexions.copy(), np.inf, np.inf, 0
    while used < min(most, _PASSES):
        left = _pass(plane, flexions, forward, palm, joined)
        used += 1
        if left < least:
            best[:], least = flexions, left
        if least <= tolerance:
            break
        if used % _WATCH == 0:
            if least > _GAIN * watched:
                break
            watched = least
    flexions[:] = best
    return least, used


@njit(cache=True)
def _from_postures(
    plane: Plane, flexions: Array, forward: float, palm: float, most: int, tolerance: float
) -> int:
    """FABRIK from where the digit is, then from other postures, then from the best of them without
    the coupling; returns passes.
    """
    best, least, used = flexions.copy(), np.inf, 0
    trial = np.empty(3)
    joined = plane.coupling[1] > 0.0
    for attempt in range(5):
        if attempt == 0 or attempt == 4:
            trial[:] = best
        else:
            for j in range(3):
                trial[j] = plane.limits[j + 1, 0] + _AGAIN[attempt - 1] * (
                    plane.limits[j + 1, 1] - plane.limits[j + 1, 0]
                )
        left, passes = _one_start(
            plane, trial, forward, palm, joined and attempt < 4, most - used, tolerance
        )
        used += passes
        if left < least:
            best[:], least = trial, left
        if least <= tolerance or used >= most:
            break
    flexions[:] = best
    return used


@njit(cache=True)
def reach(
    chain: Chain, point: Array, q: Array, shape: int, most: int, tolerance: float
) -> tuple[int, float]:
    """FABRIK alone, without the hand-over: angles q (4,) in and out.

    Returns (passes, distance left). point must be finite.
    """
    total, far = reach_of(chain), length_of(point)
    # Beyond a thousand lengths only the direction matters, and squares might overflow.
    aim = point / total if far < 1e3 * total else point / far * 1e3
    unit = scaled(chain, 1.0 / total)
    plane = plane_of(unit)
    # Half the tolerance in the plane leaves the other half to what abduction cannot face.
    fine = 0.5 * tolerance / total
    best, least, used = q.copy(), np.inf, 0
    trial = np.empty(4)
    for branch in (1, -1):
        trial[:] = q
        trial[0] = facing(aim, unit.tool[0], branch, q[0], chain.limits[0, 0], chain.limits[0, 1])
        used += _from_postures(
            plane, trial[1:], forward_of(aim, trial[0]), -aim[1], max(most - used, 1), fine
        )
        trial[0], trial[1] = swing(shape, chain.limits, trial[0], trial[1])
        left = distance_to(unit, trial, aim)
        if left < least:
            best[:], least = trial, left
        if least * total <= tolerance or used >= most:
            break
    q[:] = best
    return used, distance_to(chain, q, point)


@njit(cache=True)
def solve(
    chain: Chain, point: Array, q: Array, shape: int, most: int, tolerance: float
) -> tuple[int, float, int]:
    """Angles q (4,) that bring the painted point to point (3,), canonical frame, the chain's unit
    of length.

    shape: the base's rotor (rotor.py). Returns (passes and iterations, distance left, SOLVED |
    UNREACHABLE | NOT_CONVERGED). Angles are within limits whatever comes in.
    """
    clamp(q, chain.limits)
    total, far = reach_of(chain), length_of(point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    used, left = reach(chain, point, q, shape, most, tolerance)
    if left > tolerance and shape == BOX:
        # Limit deadlock, or out of reach: damped least squares from here finds the nearest posture
        # within the limits.
        other = q.copy()
        wanted = dls.Goal(dls.COUPLED, point, np.eye(3), np.zeros((2, 4)))
        steps, near, _ = dls.solve(chain, wanted, other, most, tolerance)
        used += steps
        if near < left:
            q[:], left = other, near
    return used, left, SOLVED if left <= tolerance else UNREACHABLE
