"""Damped least squares for one digit, the product's own: scaled, residual-damped, with the step
inside the joint limits.

Levenberg-Marquardt on the painted point (and the coupling, or the last bone's orientation), where
- lengths are divided by the digit's length, so that metres, pixels and people make no difference;
- the damping is mu = 0.01 |e|^2 + 1e-15: quadratic convergence near the goal (Fan & Yuan 2005),
  caution far from it;
- the step minimises its quadratic model *within the limits* (box_qp): clipping a free step
  afterwards stalls at limits;
- the best iterate is kept, and a start that gets stuck is repeated from mid-range and from three
  more postures.
The finger study's variant is in dls_paper.py. A target that is out of reach gives the nearest
posture and says so; one that is not finite leaves the angles as they were, as NOT_CONVERGED.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.box_qp import Integers, box_qp, newton4
from services.solver.maths.kinematics import (
    Chain,
    Chains,
    chain_of,
    distance_to,
    length_of,
    reach_of,
    to_canonical,
)
from services.solver.whole_hand.posture_prior import clamp

# What is asked for: the painted point alone; with the last bone's axes; with last flexion = ratio *
# second flexion.
POSITION, POSE, COUPLED = 0, 1, 2
# How it ended.
SOLVED, UNREACHABLE, NOT_CONVERGED = 0, 1, 2

# The coupling's residual (rad) against the position's (digit lengths). 0.01 costs at most 0.01 mm
# at the tip of a finger whose DIP is 20 deg off the ratio; 0.01 to 0.1 made no difference to the
# iterations.
COUPLING_WEIGHT = 0.01
# Iterations of one start; 5,000 random goals from random starts needed at most 14.
START_ITERATIONS = 20
# A start ends at this share of the tolerance. One more iteration than asked for costs 0.5 us and
# keeps a straight finger, whose tip hardly moves when it bends, from being left 3 deg off.
_FINER = 0.01
# Residual, in digit lengths, that double precision can still tell from none.
_FINEST = 1e-13
# rad; moves a tip by less than 1e-5 mm: with a coupling that cannot be met this is where it ends.
SMALLEST_STEP = 1e-7
# rad; a digit bent by less is straight.
_STRAIGHT = 0.03
# A step that came out worse is not taken back (going on from there leaves traps), but the next ones
# are damped this much more: without it a target out of reach has the digit swing between its
# limits.
_CAUTION = 10.0
# Share of each flexion's range in the postures that a stuck digit starts again from: mid-range
# first, then nearly open, nearly closed, and hooked (knuckle straight, the rest curled). Abduction
# starts in the middle.
_AGAIN = np.array(
    [[0.5, 0.5, 0.5, 0.5], [0.5, 0.15, 0.15, 0.15], [0.5, 0.85, 0.85, 0.85], [0.5, 0.1, 0.8, 0.8]]
)


class Goal(NamedTuple):
    """What one digit is asked for, in its canonical frame."""

    kind: int  # POSITION, POSE or COUPLED
    point: Array  # (3,) in the chain's unit of length
    rotation: Array  # (3, 3) axes of the last bone, for POSE
    # (2, 4) angles to stay near, and how strongly (0: not at all), in digit lengths per radian.
    keep: Array


def goal(kind: int, point: Array, rotation: Array | None = None) -> Goal:
    """A goal that keeps nothing."""
    return Goal(
        kind,
        np.asarray(point, dtype=np.float64),
        np.eye(3) if rotation is None else rotation,
        np.zeros((2, 4)),
    )


@njit(cache=True)
def _equations(kind: int, bones: Array, coupling: Array, point: Array, rotation: Array, keep: Array, q: Array, H: Array, g: Array) -> tuple[float, float]:  # noqa: E501 # fmt: skip
    """Fill H (4, 4) and g (4,) with a goal's normal equations (without damping); returns cost and
    distance left.

    bones (2, 4) holds lengths and tool. J'J and J'e are the same in every frame, and in the one
    that turns with abduction the geometric Jacobian (kinematics.jacobian) is nearly empty: d p / d
    abduction = (z, 0, -x), d p / d flexion_j = (0, z_j, -y_j), with (y_j, z_j) from joint j to the
    point. Plain arrays, not tuples of them: counting references to those would take most of the
    time.
    """
    s0, c0 = math.sin(q[0]), math.cos(q[0])
    s, c = math.sin(q[1] + q[2] + q[3]), math.cos(q[1] + q[2] + q[3])
    x, y3, z3 = bones[1, 0], c * bones[1, 1] + s * bones[1, 2], c * bones[1, 2] - s * bones[1, 1]
    y2, z2 = y3 - bones[0, 1] * math.sin(q[1] + q[2]), z3 - bones[0, 1] * math.cos(q[1] + q[2])
    y1, z1 = y2 - bones[0, 0] * math.sin(q[1]), z2 - bones[0, 0] * math.cos(q[1])
    ex, ey, ez = (
        c0 * point[0] - s0 * point[2] - x,
        point[1] - y1,
        s0 * point[0] + c0 * point[2] - z1,
    )
    square = ex * ex + ey * ey + ez * ez
    cost = square
    H[0, 0], H[1, 1], H[2, 2], H[3, 3] = (
        z1 * z1 + x * x,
        z1 * z1 + y1 * y1,
        z2 * z2 + y2 * y2,
        z3 * z3 + y3 * y3,
    )
    H[1, 0], H[2, 0], H[3, 0] = x * y1, x * y2, x * y3
    H[2, 1], H[3, 1], H[3, 2] = z1 * z2 + y1 * y2, z1 * z3 + y1 * y3, z2 * z3 + y2 * y3
    g[0], g[1], g[2], g[3] = (
        x * ez - z1 * ex,
        y1 * ez - z1 * ey,
        y2 * ez - z2 * ey,
        y3 * ez - z3 * ey,
    )
    if kind == POSE:
        u, v, w = _turn_left(s0, c0, s, c, rotation)
        cost += u * u + v * v + w * w
        # The axis of abduction is y, that of the three flexions -x.
        g[0] -= v
        H[0, 0] += 1.0
        for a in range(1, 4):
            g[a] += u
            for b in range(1, a + 1):
                H[a, b] += 1.0
    elif kind == COUPLED:
        ratio, weight = coupling[0], (COUPLING_WEIGHT * coupling[1]) ** 2
        off = ratio * q[2] - q[3]
        cost += weight * off * off
        g[2] += weight * ratio * off
        g[3] -= weight * off
        H[2, 2] += weight * ratio * ratio
        H[3, 3] += weight
        H[3, 2] -= weight * ratio
    for a in range(4):
        weight = keep[1, a] ** 2
        off = keep[0, a] - q[a]
        cost += weight * off * off
        g[a] -= weight * off
        H[a, a] += weight
        for b in range(a):
            H[b, a] = H[a, b]
    return cost, math.sqrt(square)


@njit(cache=True)
def _turn_left(s0: float, c0: float, s: float, c: float, goal: Array) -> tuple[float, float, float]:
    """Rotation vector from the last bone's axes to goal (3, 3), in the frame that turns with
    abduction.

    s0, c0 are of abduction, s, c of the sum of flexions. Exact also beyond 90 deg, where the
    study's differential folds back.
    """
    g00, g01, g02 = (
        c0 * goal[0, 0] - s0 * goal[2, 0],
        c0 * goal[0, 1] - s0 * goal[2, 1],
        c0 * goal[0, 2] - s0 * goal[2, 2],
    )
    g20, g21, g22 = (
        s0 * goal[0, 0] + c0 * goal[2, 0],
        s0 * goal[0, 1] + c0 * goal[2, 1],
        s0 * goal[0, 2] + c0 * goal[2, 2],
    )
    g10, g11, g12 = goal[1, 0], goal[1, 1], goal[1, 2]
    x = g21 * c + g22 * s + g11 * s - g12 * c
    y = g02 * c - g01 * s - g20
    z = g10 - g01 * c - g02 * s
    trace = g00 + g11 * c + g12 * s - g21 * s + g22 * c
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    factor = 0.5 if sine < 1e-9 else 0.5 * math.atan2(sine, 0.5 * (trace - 1.0)) / sine
    return factor * x, factor * y, factor * z


@njit(cache=True)
def _descend(chain: Chain, wanted: Goal, bones: Array, point: Array, q: Array, most: int, stop: float, room: Array, lists: Integers) -> tuple[int, float, float]:  # noqa: E501 # fmt: skip
    """One start: improve q in place until the residual is at `stop`; returns iterations, cost,
    distance left.

    bones (2, 4) and point (3,) are the chain's and the goal's with the digit's length as the unit.
    room (14, 4) and lists (2, 4) are to work in.
    """
    limits, coupling, kind, rotation, keep = (
        chain.limits,
        chain.coupling,
        wanted.kind,
        wanted.rotation,
        wanted.keep,
    )
    best, g, low, high, step, H, L = (
        room[0],
        room[1],
        room[2],
        room[3],
        room[4],
        room[5:9],
        room[9:],
    )
    best_cost, best_distance, steps, largest, caution = np.inf, np.inf, 0, 1.0, 1.0
    for iteration in range(most + 1):
        cost, distance = _equations(kind, bones, coupling, point, rotation, keep, q, H, g)
        if cost < best_cost:
            best_cost, best_distance, steps = cost, distance, iteration
            for a in range(4):
                best[a] = q[a]
            caution = max(0.1 * caution, 1.0)
        else:
            caution *= _CAUTION
        # The last step is taken and judged: breaking before that would leave up to 1e-7 rad on the
        # table.
        if cost < stop * stop or largest < SMALLEST_STEP:
            break
        for a in range(4):
            H[a, a] += caution * 0.01 * cost + 1e-15
            low[a], high[a] = limits[a, 0] - q[a], limits[a, 1] - q[a]
        inside = newton4(H, g, step)
        for a in range(4):
            inside &= low[a] <= step[a] <= high[a]
        if not inside and not box_qp(H, g, low, high, step, L, lists):
            break
        largest = 0.0
        for a in range(4):
            q[a] = min(max(q[a] + step[a], limits[a, 0]), limits[a, 1])
            largest = max(largest, abs(step[a]))
    if steps < iteration:
        for a in range(4):
            q[a] = best[a]
    return steps, best_cost, best_distance


@njit(cache=True)
def _unlock(chain: Chain, bones: Array, distance: float, q: Array) -> None:
    """Bend a straight digit (q in place) about as much as a target at that distance needs; the
    digit's length is 1.

    The distance from root to tip does not change at first when a straight digit bends: its Jacobian
    says that bending is useless, and a digit straight at its limits stays so. To second order 1 -
    d^2 = K * second flexion^2.
    """
    if abs(q[2]) + abs(q[3]) > _STRAIGHT or distance >= 1.0:
        return
    a, b, c, r = bones[0, 0], bones[0, 1], length_of(bones[1]), chain.coupling[0]
    stiffness = a * b + r * r * b * c + (1.0 + r) ** 2 * a * c
    bend = min(math.sqrt((1.0 - distance * distance) / max(stiffness, 1e-6)), 1.0)
    if bend > abs(q[2]):
        q[2], q[3] = bend, r * bend
        clamp(q, chain.limits)


def solve_digit(
    chain: Chain, wanted: Goal, q: Array, most: int, tolerance: float
) -> tuple[int, float, int]:
    """`solve`, called from Python: unpacks its arguments, which saves a quarter of the time."""
    return _unpacked(*chain, *wanted, q, most, tolerance)


@njit(cache=True)
def _unpacked(lengths: Array, tool: Array, limits: Array, coupling: Array, kind: int, point: Array, rotation: Array, keep: Array, q: Array, most: int, tolerance: float) -> tuple[int, float, int]:  # noqa: E501 # fmt: skip
    return solve(
        Chain(lengths, tool, limits, coupling),
        Goal(kind, point, rotation, keep),
        q,
        most,
        tolerance,
    )


@njit(cache=True)
def solve(
    chain: Chain, wanted: Goal, q: Array, most: int, tolerance: float
) -> tuple[int, float, int]:
    """Bring the painted point to the goal, starting from and ending in q (4,).

    Returns (iterations, distance left, SOLVED | UNREACHABLE | NOT_CONVERGED), lengths in the
    chain's unit; SOLVED means within tolerance. Angles are within limits whatever comes in.
    """
    clamp(q, chain.limits)
    total, far = reach_of(chain), length_of(wanted.point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    room, lists = np.empty((18, 4)), np.empty((2, 4), np.int64)
    bones, point, trial = room[14:16], room[16], room[17]
    # Out of reach, the digit points at it: that is asking for the point at its full length in that
    # direction, which leaves no large residual for Gauss-Newton to swing about.
    shrink = total / far if far > total else 1.0
    for i in range(3):
        bones[0, i], bones[1, i], point[i] = (
            chain.lengths[i] / total,
            chain.tool[i] / total,
            wanted.point[i] * (shrink / total),
        )
    stop = max(_FINER * tolerance / total, _FINEST)
    _unlock(chain, bones, length_of(point), q)
    used, cost, distance = _descend(
        chain, wanted, bones, point, q, min(most, START_ITERATIONS), stop, room, lists
    )
    again = 0
    while again < 4 and distance * total > tolerance and used < most:
        for j in range(4):
            trial[j] = chain.limits[j, 0] + _AGAIN[again, j] * (
                chain.limits[j, 1] - chain.limits[j, 0]
            )
        steps, trial_cost, left = _descend(
            chain,
            wanted,
            bones,
            point,
            trial,
            min(most - used, START_ITERATIONS),
            stop,
            room,
            lists,
        )
        used += steps
        again += 1
        if trial_cost < cost:
            q[:], cost, distance = trial, trial_cost, left
    if shrink == 1.0 and distance * total <= tolerance:
        return used, distance * total, SOLVED
    left = distance_to(chain, q, wanted.point)
    # Two starts that end away from the goal say that it is not to be had; one that was cut short
    # says nothing.
    return (
        used,
        left,
        SOLVED
        if left <= tolerance
        else (UNREACHABLE if again >= 2 or far > total else NOT_CONVERGED),
    )


@njit(cache=True)
def solve_digits(
    chains: Chains,
    points: Array,
    angles: Array,
    keep: Array,
    most: int,
    tolerance_m: float,
    seen: Integers,
    ends: Array,
) -> None:
    """All digits with seen[row] != 0: points (5, 3) in the wrist frame, angles (5, 4) in and out,
    goal COUPLED.

    keep (5,): how strongly each digit's angles stay near what they came with (see Goal). ends (5,
    3) gets (iterations, metres left, state).
    """
    near, nowhere = np.empty((2, 4)), np.eye(3)
    for row in range(5):
        if seen[row] != 0:
            clamp(angles[row], chains.limits_rad[row])
            near[0], near[1] = angles[row], keep[row]
            point = to_canonical(
                chains.base_m[row], chains.base_rotation[row], chains.side, points[row]
            )
            wanted = Goal(COUPLED, point, nowhere, near)
            ends[row, 0], ends[row, 1], ends[row, 2] = solve(
                chain_of(chains, row), wanted, angles[row], most, tolerance_m
            )
