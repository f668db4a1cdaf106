"""FABRIK for one digit, with the joints' limits and ways out of its traps.

Forward and backward reaching (Aristidou & Lasenby 2011). The chain is a swinging base joint
(abduction and first flexion, swing_limits.py) and two hinges that share its plane, so the plane is
turned onto the target first and the joints are placed in it (fabrik_plane.py). Everything happens
in the digit's canonical frame: turning the world changes nothing (the RHOT paper's framework
depends on it). FABRIK with limits alone sticks at nearly half of random reachable targets, and a
target on the line of a straight chain never bends it: a chain that no longer comes nearer starts
again from other postures, then without the coupling, then hands over to damped least squares. A
target beyond reach gives UNREACHABLE and a digit that points at it; one that is not finite leaves
the angles alone.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.finger import dls
from services.solver.finger.bending_plane import (
    abduction_towards,
    bending_plane,
    forward_coordinate,
)
from services.solver.finger.dls_equations import COUPLED, Goal
from services.solver.finger.fabrik_plane import reach_in_plane
from services.solver.finger.outcome import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.finger.swing_limits import BOX, clamp_swing
from services.solver.maths.chains import Chain, max_reach, norm, scale_chain
from services.solver.maths.joint_limits import clamp_to_limits
from services.solver.maths.kinematics import tip_distance


@njit(cache=True)
def solve(
    chain: Chain, point: Array, q: Array, shape: int, max_iterations: int, tolerance: float
) -> tuple[int, float, int]:
    """Angles q (4,) that bring the painted point to point (3,), in place.

    Point in the canonical frame, in the chain's unit of length. shape: the base joint's swing
    limit. Returns (passes and iterations, distance left, SOLVED | UNREACHABLE | NOT_CONVERGED).
    Angles are within limits whatever comes in.
    """
    clamp_to_limits(q, chain.limits)
    total, far = max_reach(chain), norm(point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    used, left = reach(chain, point, q, shape, max_iterations, tolerance)
    if left > tolerance and shape == BOX:
        # Limit deadlock, or out of reach: damped least squares from here finds the nearest posture
        # within the limits.
        other = q.copy()
        goal = Goal(COUPLED, point, np.eye(3), np.zeros((2, 4)))
        steps, other_left, _ = dls.solve(chain, goal, other, max_iterations, tolerance)
        used += steps
        if other_left < left:
            q[:], left = other, other_left
    return used, left, SOLVED if left <= tolerance else UNREACHABLE


@njit(cache=True)
def reach(
    chain: Chain, point: Array, q: Array, shape: int, max_iterations: int, tolerance: float
) -> tuple[int, float]:
    """FABRIK alone, without the hand-over: angles q (4,) in and out.

    Returns (passes, distance left). point must be finite.
    """
    total, far = max_reach(chain), norm(point)
    # Beyond a thousand lengths only the direction matters, and squares might overflow.
    aim = point / total if far < 1e3 * total else point / far * 1e3
    unit = scale_chain(chain, 1.0 / total)
    plane = bending_plane(unit)
    # Half the tolerance in the plane leaves the other half to what abduction cannot face.
    planar_tolerance = 0.5 * tolerance / total
    best, least, used = q.copy(), np.inf, 0
    trial = np.empty(4)
    for branch in (1, -1):
        trial[:] = q
        trial[0] = abduction_towards(aim, unit.tool[0], branch, q[0], chain.limits[0])
        target = (forward_coordinate(aim, trial[0]), -aim[1])
        left_over = max(max_iterations - used, 1)
        used += reach_in_plane(plane, trial[1:], target, left_over, planar_tolerance)
        trial[0], trial[1] = clamp_swing(shape, chain.limits, trial[0], trial[1])
        left = tip_distance(unit, trial, aim)
        if left < least:
            best[:], least = trial, left
        if least * total <= tolerance or used >= max_iterations:
            break
    q[:] = best
    return used, tip_distance(chain, q, point)
