"""Plain FABRIK for one digit, as the RHOT paper prints it (eq. 5-8), for comparison.

It has no limits and no coupling. Joints are points in space that are pulled along lines; a target
beyond the summed lengths is not solved but pointed at. It has no joint angles: they are read off
the points afterwards and brought within the limits, so that the published hand stays a hand; the
distance reported is that of the published angles. The chain of points is the paper's own form of
the kinematics; a test proves that it agrees with kinematics.tip_position. A target that is not
finite leaves the angles alone.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.finger.bending_plane import (
    abduction_towards,
    bending_plane,
    clamp_angle,
    forward_coordinate,
)
from services.solver.finger.outcome import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.maths.chains import Chain, max_reach, norm
from services.solver.maths.joint_limits import clamp_to_limits
from services.solver.maths.kinematics import tip_distance


@njit(cache=True)
def solve(
    chain: Chain, point: Array, q: Array, max_iterations: int, tolerance: float
) -> tuple[int, float, int]:
    """Angles q (4,) from plain FABRIK on point (3,), canonical frame, the chain's unit.

    Returns (iterations, distance left, SOLVED | UNREACHABLE | NOT_CONVERGED).
    """
    clamp_to_limits(q, chain.limits)
    total, far = max_reach(chain), norm(point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    plane = bending_plane(chain)
    points = joint_positions(q, plane.bones, plane.gamma)
    # Beyond a thousand lengths only the direction matters, and squares might overflow.
    aim = point if far < 1e3 * total else point / far * (1e3 * total)
    used = reach(points, aim, plane.bones, max_iterations, 0.5 * tolerance)
    angles_from_positions(points, plane.gamma, chain.limits, q)
    left = tip_distance(chain, q, point)
    if left <= tolerance:
        return used, left, SOLVED
    return used, left, UNREACHABLE if used < max_iterations else NOT_CONVERGED


@njit(cache=True)
def reach(points: Array, target: Array, bones: Array, max_iterations: int, tolerance: float) -> int:
    """Pull the joints points (4, 3), in place, until the last is at target (3,).

    Returns the iterations.
    """
    root = points[0].copy()
    if norm(target - root) > bones[0] + bones[1] + bones[2]:
        for k in range(3):
            points[k + 1] = _point_on_line(points[k], target, bones[k])
        return 1
    for iteration in range(max_iterations):
        points[3] = target
        for k in range(2, -1, -1):
            points[k] = _point_on_line(points[k + 1], points[k], bones[k])
        points[0] = root
        for k in range(3):
            points[k + 1] = _point_on_line(points[k], points[k + 1], bones[k])
        if norm(points[3] - target) <= tolerance:
            return iteration + 1
    return max_iterations


@njit(cache=True)
def _point_on_line(start: Array, towards: Array, length: float) -> Array:
    """The point (3,) at `length` from `start` towards `towards`, RHOT eq. (7) and (8)."""
    gap = towards - start
    size = norm(gap)
    return start + gap * (length / size) if size > 1e-12 else start + np.array([0.0, 0.0, -length])


@njit(cache=True)
def joint_positions(q: Array, bones: Array, gamma: float) -> Array:
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
def angles_from_positions(points: Array, gamma: float, limits: Array, q: Array) -> None:
    """Angles q (4,), within limits (4, 2), of joints points (4, 3), canonical frame.

    In the plane through the last joint.
    """
    q[0] = abduction_towards(points[3], 0.0, 1, q[0], limits[0])
    before = 0.0
    for k in range(3):
        bone = points[k + 1] - points[k]
        turn = math.atan2(-bone[1], forward_coordinate(bone, q[0])) - (gamma if k == 2 else 0.0)
        q[k + 1] = clamp_angle(turn - before, limits[k + 1, 0], limits[k + 1, 1])
        before = turn
