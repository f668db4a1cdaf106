"""Closed form for one digit whose last flexion depends on the second (DIP = 2/3 PIP): the finger
study's analytical method.

Abduction turns the chain's plane onto the target. In the plane, the distance from root to tip
depends on the second flexion alone: one equation, solved by Newton's method inside a bracket; the
first flexion then turns the tip onto the target. Exact wherever the coupling and the limits allow
it; elsewhere the nearest tip on the coupled family is found by a search over that one unknown, and
the result says UNREACHABLE. A person whose fingers do not follow the ratio is misrepresented, as
the study found in full fists.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.finger.bending_plane import Plane, facing, forward_of, plane_of, wrapped
from services.solver.finger.dls import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.maths.kinematics import Chain, distance_to, length_of, reach_of, scaled
from services.solver.whole_hand.posture_prior import clamp


@njit(cache=True)
def _followed(plane: Plane, second: float) -> tuple[float, float]:
    """The last flexion that follows a second one, and its slope.

    Where its own limit stops it the slope is 0.
    """
    follow = plane.coupling[0] * second
    if follow < plane.limits[3, 0]:
        return plane.limits[3, 0], 0.0
    if follow > plane.limits[3, 1]:
        return plane.limits[3, 1], 0.0
    return follow, plane.coupling[0]


@njit(cache=True)
def _tip(plane: Plane, second: float) -> tuple[float, float, float, float]:
    """Tip in the plane at zero first flexion: forward, palm, and their derivatives by the second
    flexion.
    """
    follow, slope = _followed(plane, second)
    last = second + follow + plane.gamma
    b, c = plane.bones[1], plane.bones[2]
    forward = plane.bones[0] + b * math.cos(second) + c * math.cos(last)
    palm = b * math.sin(second) + c * math.sin(last)
    d_forward = -b * math.sin(second) - (1.0 + slope) * c * math.sin(last)
    d_palm = b * math.cos(second) + (1.0 + slope) * c * math.cos(last)
    return forward, palm, d_forward, d_palm


@njit(cache=True)
def _bend(plane: Plane, square: float) -> tuple[float, int]:
    """Second flexion at which the tip is sqrt(square) from the root: Newton in a bracket.

    The nearer end where there is none.
    """
    low, high = plane.limits[2, 0], plane.limits[2, 1]
    f, p, _, _ = _tip(plane, low)
    at_low = f * f + p * p - square
    f, p, _, _ = _tip(plane, high)
    at_high = f * f + p * p - square
    if at_low * at_high > 0.0:
        return (low, 0) if abs(at_low) < abs(at_high) else (high, 0)
    x = 0.5 * (low + high)
    for iteration in range(60):
        f, p, df, dp = _tip(plane, x)
        value, slope = f * f + p * p - square, 2.0 * (f * df + p * dp)
        if abs(value) < 1e-15:
            return x, iteration
        if value * at_low > 0.0:
            low = x
        else:
            high = x
        x = x - value / slope if slope != 0.0 else low
        if not low < x < high:
            x = 0.5 * (low + high)
    return x, 60


@njit(cache=True)
def _apart(plane: Plane, first: float, second: float, forward: float, palm: float) -> float:
    """Squared distance in the plane from the tip to a point."""
    f, p, _, _ = _tip(plane, second)
    c, s = math.cos(first), math.sin(first)
    return (c * f - s * p - forward) ** 2 + (s * f + c * p - palm) ** 2


@njit(cache=True)
def _nearest(plane: Plane, first: float, forward: float, palm: float) -> float:
    """With the first flexion held, the second one whose tip is nearest: coarse scan, then golden
    section.
    """
    low, high = plane.limits[2, 0], plane.limits[2, 1]
    width = (high - low) / 16.0
    best, least = low, _apart(plane, first, low, forward, palm)
    for k in range(1, 17):
        value = _apart(plane, first, low + k * width, forward, palm)
        if value < least:
            best, least = low + k * width, value
    a, b, golden = max(best - width, low), min(best + width, high), 0.5 * (math.sqrt(5.0) - 1.0)
    # 30 sections narrow an eighth of the range to 1e-7 of it.
    for _ in range(30):
        c, d = b - golden * (b - a), a + golden * (b - a)
        if _apart(plane, first, c, forward, palm) < _apart(plane, first, d, forward, palm):
            b = d
        else:
            a = c
    return 0.5 * (a + b)


@njit(cache=True)
def solve(chain: Chain, point: Array, q: Array, tolerance: float) -> tuple[int, float, int]:
    """Angles q (4,) that bring the painted point to point (3,), canonical frame, the chain's unit
    of length.

    Returns (iterations, distance left, SOLVED | UNREACHABLE | NOT_CONVERGED). q is only kept where
    the point says nothing.
    """
    clamp(q, chain.limits)
    total, far = reach_of(chain), length_of(point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    # Beyond a thousand lengths only the direction matters, and squares might overflow.
    aim = point / total if far < 1e3 * total else point / far * 1e3
    unit = scaled(chain, 1.0 / total)
    plane = plane_of(unit)
    best, least, used = q.copy(), np.inf, 0
    trial = np.empty(4)
    for branch in (1, -1):
        trial[0] = facing(aim, unit.tool[0], branch, q[0], chain.limits[0, 0], chain.limits[0, 1])
        forward, palm = forward_of(aim, trial[0]), -aim[1]
        trial[2], steps = _bend(plane, forward**2 + palm**2)
        f, p, _, _ = _tip(plane, trial[2])
        free = wrapped(math.atan2(palm, forward) - math.atan2(p, f))
        trial[1] = min(max(free, chain.limits[1, 0]), chain.limits[1, 1])
        if trial[1] != free:
            trial[2] = _nearest(plane, trial[1], forward, palm)
        trial[3], _ = _followed(plane, trial[2])
        used += steps
        left = distance_to(unit, trial, aim)
        # Both branches can be exact; the first stands unless the second is better by more than
        # rounding.
        if left < least - 1e-9:
            best[:], least = trial, left
    q[:] = best
    left = distance_to(chain, q, point)
    return used, left, SOLVED if left <= tolerance else UNREACHABLE
