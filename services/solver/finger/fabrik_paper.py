"""Plain FABRIK for one digit, as the RHOT paper prints it (eq. 5-8): no limits, no coupling; here
for comparison.

Joints are points in space that are pulled along lines; a target beyond the summed lengths is not
solved but pointed at. It has no joint angles: they are read off the points afterwards and brought
within the limits, so that the published hand stays a hand; the distance reported is that of the
published angles. A target that is not finite leaves the angles alone.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.finger.bending_plane import facing, forward_of, limited, plane_of
from services.solver.finger.dls import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.maths.kinematics import Chain, distance_to, length_of, reach_of
from services.solver.whole_hand.posture_prior import clamp


@njit(cache=True)
def _pulled(fixed: Array, free: Array, length: float) -> Array:
    """The point at `length` from `fixed` towards `free`, RHOT eq. (7) and (8); (3,)."""
    gap = free - fixed
    size = length_of(gap)
    return fixed + gap * (length / size) if size > 1e-12 else fixed + np.array([0.0, 0.0, -length])


@njit(cache=True)
def joints_of(q: Array, bones: Array, gamma: float) -> Array:
    """The four joints of the chain in the canonical frame; q (4,), bones (3,) -> (4, 3)."""
    points = np.zeros((4, 3))
    angle = 0.0
    for k in range(3):
        angle += q[k + 1]
        turn = angle + (gamma if k == 2 else 0.0)
        depth = -bones[k] * math.cos(turn)
        points[k + 1, 0] = points[k, 0] + math.sin(q[0]) * depth
        points[k + 1, 1] = points[k, 1] - bones[k] * math.sin(turn)
        points[k + 1, 2] = points[k, 2] + math.cos(q[0]) * depth
    return points


@njit(cache=True)
def reach(points: Array, target: Array, bones: Array, most: int, tolerance: float) -> int:
    """Pull the joints (4, 3) until the last is at target (3,); in place; returns the iterations."""
    root = points[0].copy()
    if length_of(target - root) > bones[0] + bones[1] + bones[2]:
        for k in range(3):
            points[k + 1] = _pulled(points[k], target, bones[k])
        return 1
    for iteration in range(most):
        points[3] = target
        for k in range(2, -1, -1):
            points[k] = _pulled(points[k + 1], points[k], bones[k])
        points[0] = root
        for k in range(3):
            points[k + 1] = _pulled(points[k], points[k + 1], bones[k])
        if length_of(points[3] - target) <= tolerance:
            return iteration + 1
    return most


@njit(cache=True)
def angles_of(points: Array, gamma: float, limits: Array, q: Array) -> None:
    """Angles q (4,), within limits, of joints (4, 3) in the canonical frame, in the plane through
    the last joint.
    """
    q[0] = facing(points[3], 0.0, 1, q[0], limits[0, 0], limits[0, 1])
    before = 0.0
    for k in range(3):
        bone = points[k + 1] - points[k]
        turn = math.atan2(-bone[1], forward_of(bone, q[0])) - (gamma if k == 2 else 0.0)
        q[k + 1] = limited(turn - before, limits[k + 1, 0], limits[k + 1, 1])
        before = turn


@njit(cache=True)
def solve(
    chain: Chain, point: Array, q: Array, most: int, tolerance: float
) -> tuple[int, float, int]:
    """Angles q (4,) from plain FABRIK on point (3,), canonical frame, the chain's unit.

    Returns (iterations, distance, state).
    """
    clamp(q, chain.limits)
    total, far = reach_of(chain), length_of(point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    plane = plane_of(chain)
    joints = joints_of(q, plane.bones, plane.gamma)
    used = reach(
        joints,
        point if far < 1e3 * total else point / far * (1e3 * total),
        plane.bones,
        most,
        0.5 * tolerance,
    )
    angles_of(joints, plane.gamma, chain.limits, q)
    left = distance_to(chain, q, point)
    if left <= tolerance:
        return used, left, SOLVED
    return used, left, UNREACHABLE if used < most else NOT_CONVERGED
