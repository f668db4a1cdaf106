"""The finger study's analytical method: closed form for a digit with DIP = 2/3 PIP.

The last flexion of the digit depends on the second. Abduction turns the chain's plane onto the
target. In the plane, the distance from root to tip depends on the second flexion alone: one
equation, solved by Newton's method inside a bracket; the first flexion then turns the tip onto the
target. Exact wherever the coupling and the limits allow it; elsewhere the nearest tip on the
coupled family is found by a search over that one unknown, and the result says UNREACHABLE. A person
whose fingers do not follow the ratio is misrepresented, as the study found in full fists.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.finger.bending_plane import (
    BendingPlane,
    abduction_towards,
    bending_plane,
    forward_coordinate,
    wrap_angle,
)
from services.solver.finger.outcome import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.maths.chains import Chain, max_reach, norm, scale_chain
from services.solver.maths.joint_limits import clamp_to_limits
from services.solver.maths.kinematics import tip_distance


@njit(cache=True)
def solve(chain: Chain, point: Array, q: Array, tolerance: float) -> tuple[int, float, int]:
    """Angles q (4,) that bring the painted point to point (3,), in place.

    Point in the canonical frame, in the chain's unit of length. Returns (iterations, distance left,
    SOLVED | UNREACHABLE | NOT_CONVERGED). q is only kept where the point says nothing.
    """
    clamp_to_limits(q, chain.limits)
    total, far = max_reach(chain), norm(point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    # Beyond a thousand lengths only the direction matters, and squares might overflow.
    aim = point / total if far < 1e3 * total else point / far * 1e3
    unit = scale_chain(chain, 1.0 / total)
    plane = bending_plane(unit)
    best, least, used = q.copy(), np.inf, 0
    trial = np.empty(4)
    for branch in (1, -1):
        trial[0] = abduction_towards(aim, unit.tool[0], branch, q[0], chain.limits[0])
        used += _solve_in_plane(plane, forward_coordinate(aim, trial[0]), -aim[1], trial)
        left = tip_distance(unit, trial, aim)
        # Both branches can be exact; the first stands unless the second is better by more than
        # rounding.
        if left < least - 1e-9:
            best[:], least = trial, left
    q[:] = best
    left = tip_distance(chain, q, point)
    return used, left, SOLVED if left <= tolerance else UNREACHABLE


@njit(cache=True)
def _solve_in_plane(plane: BendingPlane, forward: float, palmar: float, q: Array) -> int:
    """Flexions q[1:] whose tip is at (forward, palmar), or nearest to it; returns iterations."""
    q[2], iterations = _flexion_at_distance(plane, forward**2 + palmar**2)
    f, p, _, _ = _coupled_tip(plane, q[2])
    free = wrap_angle(math.atan2(palmar, forward) - math.atan2(p, f))
    q[1] = min(max(free, plane.limits[1, 0]), plane.limits[1, 1])
    if q[1] != free:
        q[2] = _nearest_flexion(plane, q[1], forward, palmar)
    q[3], _ = _coupled_flexion(plane, q[2])
    return iterations


@njit(cache=True)
def _coupled_flexion(plane: BendingPlane, second: float) -> tuple[float, float]:
    """The last flexion that follows the second, and its slope: 0 where its own limit stops it."""
    last = plane.coupling[0] * second
    if last < plane.limits[3, 0]:
        return plane.limits[3, 0], 0.0
    if last > plane.limits[3, 1]:
        return plane.limits[3, 1], 0.0
    return last, plane.coupling[0]


@njit(cache=True)
def _coupled_tip(plane: BendingPlane, second: float) -> tuple[float, float, float, float]:
    """Tip in the plane at zero first flexion: forward, palmar, and both derivatives.

    The derivatives are by the second flexion. bending_plane.planar_tip with derivatives: apart,
    sines and cosines would be computed twice.
    """
    last, slope = _coupled_flexion(plane, second)
    angle = second + last + plane.gamma
    b, c = plane.bones[1], plane.bones[2]
    forward = plane.bones[0] + b * math.cos(second) + c * math.cos(angle)
    palmar = b * math.sin(second) + c * math.sin(angle)
    d_forward = -b * math.sin(second) - (1.0 + slope) * c * math.sin(angle)
    d_palmar = b * math.cos(second) + (1.0 + slope) * c * math.cos(angle)
    return forward, palmar, d_forward, d_palmar


@njit(cache=True)
def _flexion_at_distance(plane: BendingPlane, square: float) -> tuple[float, int]:
    """Second flexion at which the tip is sqrt(square) from the root: Newton in a bracket.

    The nearer end where there is none. With the iterations used.
    """
    low, high = plane.limits[2, 0], plane.limits[2, 1]
    f, p, _, _ = _coupled_tip(plane, low)
    at_low = f * f + p * p - square
    f, p, _, _ = _coupled_tip(plane, high)
    at_high = f * f + p * p - square
    if at_low * at_high > 0.0:
        return (low, 0) if abs(at_low) < abs(at_high) else (high, 0)
    x = 0.5 * (low + high)
    for iteration in range(60):
        f, p, df, dp = _coupled_tip(plane, x)
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
def _squared_distance(
    plane: BendingPlane, first: float, second: float, forward: float, palmar: float
) -> float:
    """Squared distance in the plane from the coupled tip to a point."""
    f, p, _, _ = _coupled_tip(plane, second)
    c, s = math.cos(first), math.sin(first)
    return (c * f - s * p - forward) ** 2 + (s * f + c * p - palmar) ** 2


@njit(cache=True)
def _nearest_flexion(plane: BendingPlane, first: float, forward: float, palmar: float) -> float:
    """With the first flexion held, the second one whose tip is nearest to a point.

    Coarse scan, then golden section.
    """
    low, high = plane.limits[2, 0], plane.limits[2, 1]
    width = (high - low) / 16.0
    best, least = low, _squared_distance(plane, first, low, forward, palmar)
    for k in range(1, 17):
        value = _squared_distance(plane, first, low + k * width, forward, palmar)
        if value < least:
            best, least = low + k * width, value
    a, b = max(best - width, low), min(best + width, high)
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    # 30 sections narrow an eighth of the range to 1e-7 of it.
    for _ in range(30):
        c, d = b - golden * (b - a), a + golden * (b - a)
        left = _squared_distance(plane, first, c, forward, palmar)
        right = _squared_distance(plane, first, d, forward, palmar)
        if left < right:
            b = d
        else:
            a = c
    return 0.5 * (a + b)
