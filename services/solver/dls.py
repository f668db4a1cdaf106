"""Damped least squares for one digit, the product's own: scaled, residual-damped, with the step inside the joint limits.

Levenberg-Marquardt on the painted point (and the coupling, or the last bone's orientation), where
- lengths are divided by the digit's length, so that metres, pixels and people make no difference;
- the damping is mu = 0.01 |e|^2 + 1e-15: quadratic convergence near the goal (Fan & Yuan 2005), caution far from it;
- the step minimises its quadratic model *within the limits* (box_qp): clipping a free step afterwards stalls at limits;
- the best iterate is kept, and a start that gets stuck is repeated from mid-range and from three more postures.
The finger study's variant is in dls_paper.py. A target that is out of reach gives the nearest posture and says so; one that is
not finite leaves the angles as they were, as NOT_CONVERGED.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.transforms import Array
from services.solver.box_qp import Integers, Scratch, box_qp, scratch
from services.solver.constraints import clamp
from services.solver.kinematics import (
    Chain,
    Chains,
    chain_of,
    distance_to,
    jacobian,
    length_of,
    reach_of,
    scaled,
    tip_rotation,
    to_canonical,
)
from services.solver.turns import turn_between

# What is asked for: the painted point alone; with the last bone's axes; with last flexion = ratio * second flexion.
POSITION, POSE, COUPLED = 0, 1, 2
# How it ended.
SOLVED, UNREACHABLE, NOT_CONVERGED = 0, 1, 2

# The coupling's residual (rad) against the position's (digit lengths). 0.01 costs at most 0.01 mm at the tip of a finger
# whose DIP is 20 deg off the ratio; 0.01 to 0.1 made no difference to the iterations.
COUPLING_WEIGHT = 0.01
# Iterations of one start; 5,000 random goals from random starts needed at most 14.
START_ITERATIONS = 20
# Residual, in digit lengths, at which a start ends: less than 1e-6 mm.
STOP = 1e-8
# rad; moves a tip by less than 1e-5 mm: with a coupling that cannot be met this is where it ends.
SMALLEST_STEP = 1e-7
# rad; a digit bent by less is straight.
_STRAIGHT = 0.03
# A step that came out worse is not taken back (going on from there leaves traps), but the next ones are damped this much more:
# without it a target out of reach has the digit swing between its limits.
_CAUTION = 10.0
# Share of each flexion's range in the postures that a stuck digit starts again from: mid-range first, then nearly open, nearly
# closed, and hooked (knuckle straight, the rest curled). Abduction starts in the middle.
_AGAIN = np.array([[0.5, 0.5, 0.5, 0.5], [0.5, 0.15, 0.15, 0.15], [0.5, 0.85, 0.85, 0.85], [0.5, 0.1, 0.8, 0.8]])


class Goal(NamedTuple):
    """What one digit is asked for, in its canonical frame."""

    kind: int  # POSITION, POSE or COUPLED
    point: Array  # (3,) in the chain's unit of length
    rotation: Array  # (3, 3) axes of the last bone, for POSE
    # (2, 4) angles to stay near, and how strongly (0: not at all), in digit lengths per radian.
    keep: Array


def goal(kind: int, point: Array, rotation: Array | None = None) -> Goal:
    """A goal that keeps nothing."""
    return Goal(kind, np.asarray(point, dtype=np.float64), np.eye(3) if rotation is None else rotation, np.zeros((2, 4)))


class Desk(NamedTuple):
    """Room to work in: allocating it at every start would cost as much as an iteration."""

    p: Array  # (3,) the painted point
    J: Array  # (6, 4)
    turn: Array  # (3,) the rotation that is left
    H: Array  # (4, 4)
    g: Array  # (4,)
    low: Array  # (4,)
    high: Array  # (4,)
    step: Array  # (4,)
    best: Array  # (4,)
    qp: Scratch


@njit(cache=True)
def _desk() -> Desk:
    return Desk(
        np.empty(3),
        np.empty((6, 4)),
        np.empty(3),
        np.empty((4, 4)),
        np.empty(4),
        np.empty(4),
        np.empty(4),
        np.empty(4),
        np.empty(4),
        scratch(4),
    )


@njit(cache=True)
def _equations(chain: Chain, wanted: Goal, q: Array, desk: Desk) -> tuple[float, float]:
    """Fill H and g with the goal's normal equations (without damping); returns cost and distance left."""
    p, J, H, g = desk.p, desk.J, desk.H, desk.g
    jacobian(chain, q, p, J)
    x, y, z = wanted.point[0] - p[0], wanted.point[1] - p[1], wanted.point[2] - p[2]
    square = x * x + y * y + z * z
    cost = square
    for a in range(4):
        g[a] = -(J[0, a] * x + J[1, a] * y + J[2, a] * z)
        for b in range(a + 1):
            H[a, b] = J[0, a] * J[0, b] + J[1, a] * J[1, b] + J[2, a] * J[2, b]
    if wanted.kind == POSE:
        # A rotation vector: exact also beyond 90 deg, where the study's differential folds back.
        turn = desk.turn
        turn_between(tip_rotation(q), wanted.rotation, turn)
        cost += turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]
        # Axes: that of abduction is y, the three of flexion are one and square to it.
        g[0] -= turn[1]
        H[0, 0] += 1.0
        for a in range(1, 4):
            g[a] -= J[3, a] * turn[0] + J[5, a] * turn[2]
            for b in range(1, a + 1):
                H[a, b] += 1.0
    elif wanted.kind == COUPLED:
        ratio, weight = chain.coupling[0], (COUPLING_WEIGHT * chain.coupling[1]) ** 2
        off = ratio * q[2] - q[3]
        cost += weight * off * off
        g[2] += weight * ratio * off
        g[3] -= weight * off
        H[2, 2] += weight * ratio * ratio
        H[3, 3] += weight
        H[3, 2] -= weight * ratio
    for a in range(4):
        weight = wanted.keep[1, a] ** 2
        off = wanted.keep[0, a] - q[a]
        cost += weight * off * off
        g[a] -= weight * off
        H[a, a] += weight
        for b in range(a):
            H[b, a] = H[a, b]
    return cost, math.sqrt(square)


@njit(cache=True)
def _descend(chain: Chain, wanted: Goal, q: Array, most: int, desk: Desk) -> tuple[int, float, float]:
    """One start: improve q in place; returns iterations, cost, distance left. The digit's length is 1."""
    limits, H, low, high, step, best = chain.limits, desk.H, desk.low, desk.high, desk.step, desk.best
    best_cost, best_distance, steps, largest, caution = np.inf, np.inf, 0, 1.0, 1.0
    best[:] = q
    for iteration in range(most + 1):
        cost, distance = _equations(chain, wanted, q, desk)
        if cost < best_cost:
            best[:], best_cost, best_distance, steps = q, cost, distance, iteration
            caution = max(0.1 * caution, 1.0)
        else:
            caution *= _CAUTION
        # The last step is taken and judged: breaking before that would leave up to 1e-7 rad on the table.
        if cost < STOP * STOP or largest < SMALLEST_STEP:
            break
        for a in range(4):
            H[a, a] += caution * 0.01 * cost + 1e-15
            low[a], high[a] = limits[a, 0] - q[a], limits[a, 1] - q[a]
        if not box_qp(H, desk.g, low, high, step, desk.qp):
            break
        largest = 0.0
        for a in range(4):
            q[a] = min(max(q[a] + step[a], limits[a, 0]), limits[a, 1])
            largest = max(largest, abs(step[a]))
    q[:] = best
    return steps, best_cost, best_distance


@njit(cache=True)
def _unlock(unit: Chain, distance: float, q: Array) -> None:
    """Bend a straight digit (q in place) about as much as a target at that distance needs; the digit's length is 1.

    The distance from root to tip does not change at first when a straight digit bends: its Jacobian says that bending is useless,
    and a digit straight at its limits stays so. To second order 1 - d^2 = K * second flexion^2.
    """
    if abs(q[2]) + abs(q[3]) > _STRAIGHT or distance >= 1.0:
        return
    a, b, c, r = unit.lengths[0], unit.lengths[1], length_of(unit.tool), unit.coupling[0]
    stiffness = a * b + r * r * b * c + (1.0 + r) ** 2 * a * c
    bend = min(math.sqrt((1.0 - distance * distance) / max(stiffness, 1e-6)), 1.0)
    if bend > abs(q[2]):
        q[2], q[3] = bend, r * bend
        clamp(q, unit.limits)


@njit(cache=True)
def solve(chain: Chain, wanted: Goal, q: Array, most: int, tolerance: float) -> tuple[int, float, int]:
    """Bring the painted point to the goal, starting from and ending in q (4,).

    Returns (iterations, distance left, SOLVED | UNREACHABLE | NOT_CONVERGED), lengths in the chain's unit; SOLVED means within
    tolerance. Angles are within limits whatever comes in.
    """
    clamp(q, chain.limits)
    total, far = reach_of(chain), length_of(wanted.point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    # Out of reach, the digit points at it: that is asking for the point at its full length in that direction, which leaves no
    # large residual for Gauss-Newton to swing about.
    shrink = min(1.0, total / far) if far > 0.0 else 1.0
    unit = scaled(chain, 1.0 / total)
    aim = Goal(wanted.kind, wanted.point * (shrink / total), wanted.rotation, wanted.keep)
    _unlock(unit, length_of(aim.point), q)
    desk = _desk()
    used, cost, distance = _descend(unit, aim, q, min(most, START_ITERATIONS), desk)
    trial, again = np.empty(4), 0
    for attempt in range(4):
        if distance * total <= tolerance or used >= most:
            break
        for j in range(4):
            trial[j] = chain.limits[j, 0] + _AGAIN[attempt, j] * (chain.limits[j, 1] - chain.limits[j, 0])
        steps, trial_cost, left = _descend(unit, aim, trial, min(most - used, START_ITERATIONS), desk)
        used += steps
        again += 1
        if trial_cost < cost:
            q[:], cost, distance = trial, trial_cost, left
    left = distance_to(chain, q, wanted.point)
    if left <= tolerance:
        return used, left, SOLVED
    # Two starts that end away from the goal say that it is not to be had; one that was cut short says nothing.
    return used, left, UNREACHABLE if again >= 2 or far > total else NOT_CONVERGED


@njit(cache=True)
def solve_digits(
    chains: Chains, points: Array, angles: Array, keep: Array, most: int, tolerance_m: float, seen: Integers, ends: Array
) -> None:
    """All digits with seen[row] != 0: points (5, 3) in the wrist frame, angles (5, 4) in and out, goal COUPLED.

    keep (5,): how strongly each digit's angles stay near what they came with (see Goal). ends (5, 3) gets (iterations, metres left, state).
    """
    near, nowhere = np.empty((2, 4)), np.eye(3)
    for row in range(5):
        if seen[row] != 0:
            near[0], near[1] = angles[row], keep[row]
            point = to_canonical(chains.base_m[row], chains.base_rotation[row], chains.side, points[row])
            wanted = Goal(COUPLED, point, nowhere, near)
            ends[row, 0], ends[row, 1], ends[row, 2] = solve(chain_of(chains, row), wanted, angles[row], most, tolerance_m)
