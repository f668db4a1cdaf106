"""Damped least squares for one digit, the product's own: Levenberg-Marquardt within the limits.

- dls_equations.py: the residual (painted point, with the coupling or the last bone's orientation
  beside it) and its normal equations, with lengths relative to the digit's own;
- dls_step.py: damping and step, iterated within the joint limits from one start;
- here: a start that gets stuck is repeated from mid-range and from three more postures.
The finger study's variant is in dls_paper.py. A target that is out of reach gives the nearest
posture and says so; one that is not finite leaves the angles as they were, as NOT_CONVERGED.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import unowned
from services.solver.finger.dls_equations import COUPLED, Goal, Problem
from services.solver.finger.dls_step import Memory, iterate
from services.solver.finger.outcome import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import (
    Chain,
    HandChains,
    canonical_from_wrist,
    digit_chain,
    max_reach,
    norm,
)
from services.solver.maths.joint_limits import clamp_to_limits
from services.solver.maths.kinematics import tip_distance

# Iterations of one start; 5,000 random goals from random starts needed at most 14.
_MAX_ITERATIONS_PER_START = 20
# A start ends at this share of the tolerance. One more iteration than asked for costs 0.5 us and
# keeps a straight finger, whose tip hardly moves when it bends, from being left 3 deg off.
_CONVERGED_SHARE = 0.01
# Residual, in digit lengths, that double precision can still tell from none.
_MIN_RESIDUAL = 1e-13
# rad; a digit bent by less is straight.
_STRAIGHT_RAD = 0.03
# rad; where every posture that costs less than the one found is within this of the prior's angles,
# there is no other minimum to look for. Of 12,500 digits (hands that close, markers hidden, wrong
# or noisy) all angles but one, by 1e-6 rad, are the same as with four restarts; iterations fall
# from 19 to 5 a digit.
_ONE_MINIMUM_RAD = 0.3
# Share of each joint's range in the postures that a stuck digit starts again from: mid-range first,
# then nearly open, nearly closed, and hooked (knuckle straight, the rest curled). Abduction starts
# in the middle.
_RESTART_POSTURES = np.array(
    [[0.5, 0.5, 0.5, 0.5], [0.5, 0.15, 0.15, 0.15], [0.5, 0.85, 0.85, 0.85], [0.5, 0.1, 0.8, 0.8]]
)


def solve_digit(
    chain: Chain, goal: Goal, q: Array, max_iterations: int, tolerance: float
) -> tuple[int, float, int]:
    """`solve`, called from Python: unpacks its tuples, which saves a quarter of the time."""
    return _solve_unpacked(*chain, *goal, q, max_iterations, tolerance)


@njit(cache=True)
def solve(
    chain: Chain, goal: Goal, q: Array, max_iterations: int, tolerance: float
) -> tuple[int, float, int]:
    """Bring the painted point to the goal, starting from and ending in q (4,).

    Returns (iterations, distance left, SOLVED | UNREACHABLE | NOT_CONVERGED), lengths in the
    chain's unit; SOLVED means within tolerance. Angles are within limits whatever comes in.
    """
    chain, goal, q = unowned((chain, goal, q))
    clamp_to_limits(q, chain.limits)
    total, far = max_reach(chain), norm(goal.point)
    if not (math.isfinite(far) and total > 1e-9):
        return 0, far if math.isfinite(far) else 0.0, NOT_CONVERGED
    # Out of reach, the digit points at it: that is asking for the point at its full length in that
    # direction, which leaves no large residual for Gauss-Newton to swing about.
    shrink = total / far if far > total else 1.0
    rows = np.empty((18, 4))
    memory, trial = Memory(rows, np.empty((2, 4), np.int64)), rows[17]
    problem = _unit_problem(chain, goal, total, shrink, rows[14:17])
    stop = max(_CONVERGED_SHARE * tolerance / total, _MIN_RESIDUAL)
    _leave_singularity(problem, q)
    used, cost, distance = iterate(
        problem, q, min(max_iterations, _MAX_ITERATIONS_PER_START), stop, memory
    )
    restarts = 0
    settled = used < _MAX_ITERATIONS_PER_START and _is_only_minimum(goal.prior, cost)
    while not settled and restarts < 4 and distance * total > tolerance and used < max_iterations:
        _restart_posture(chain.limits, restarts, trial)
        steps, trial_cost, trial_distance = iterate(
            problem, trial, min(max_iterations - used, _MAX_ITERATIONS_PER_START), stop, memory
        )
        used += steps
        restarts += 1
        if trial_cost < cost:
            q[:], cost, distance = trial, trial_cost, trial_distance
    if shrink == 1.0 and distance * total <= tolerance:
        return used, distance * total, SOLVED
    left = tip_distance(chain, q, goal.point)
    if left <= tolerance:
        return used, left, SOLVED
    # Two starts that end away from the goal say that it is not to be had; one that was cut short
    # says nothing.
    hopeless = settled or restarts >= 2 or far > total
    return used, left, UNREACHABLE if hopeless else NOT_CONVERGED


@njit(cache=True)
def _is_only_minimum(prior: Array, cost: float) -> bool:
    """Whether all postures that cost less are near the prior's angles: a restart finds no other.

    What is further off in any angle costs more by that alone. prior (2, 4) as in Goal.
    """
    return cost <= (_ONE_MINIMUM_RAD * prior[1].min()) ** 2


class TipTargets(NamedTuple):
    """Where the painted tips of all digits were seen."""

    points_m: Array  # (5, 3) wrist frame
    measured: Integers  # (5,) 0: this digit is left as it is
    prior_weight: Array  # (5,) how strongly its angles stay near what they were (see Goal)


@njit(cache=True)
def solve_digits(
    chains: HandChains,
    targets: TipTargets,
    angles: Array,
    max_iterations: int,
    tolerance_m: float,
    ends: Array,
) -> None:
    """All measured digits by `solve`, with the goal COUPLED.

    angles (5, 4) rad in and out; ends (5, 3) gets (iterations, metres left, outcome).
    """
    goals, options = (np.empty((2, 4)), np.eye(3)), (max_iterations, tolerance_m)
    _solve_each(chains, targets, goals, options, angles, ends)


@njit(cache=True)
def _solve_each(
    chains: HandChains,
    targets: TipTargets,
    goals: tuple[Array, Array],
    options: tuple[int, float],
    angles: Array,
    ends: Array,
) -> None:
    """The same; goals: memory (2, 4) for a prior, and a rotation (3, 3) that nobody asks for."""
    chains, targets, angles, ends = unowned((chains, targets, angles, ends))
    (prior, no_rotation), (max_iterations, tolerance_m) = unowned(goals), options
    for row in range(5):
        if targets.measured[row] != 0:
            clamp_to_limits(angles[row], chains.limits_rad[row])
            prior[0], prior[1] = angles[row], targets.prior_weight[row]
            point = canonical_from_wrist(
                chains.base_m[row], chains.base_rotation[row], chains.side, targets.points_m[row]
            )
            goal = Goal(COUPLED, point, no_rotation, prior)
            ends[row, 0], ends[row, 1], ends[row, 2] = solve(
                digit_chain(chains, row), goal, angles[row], max_iterations, tolerance_m
            )


@njit(cache=True)
def _solve_unpacked(
    lengths: Array,
    tool: Array,
    limits: Array,
    coupling: Array,
    kind: int,
    point: Array,
    rotation: Array,
    prior: Array,
    q: Array,
    max_iterations: int,
    tolerance: float,
) -> tuple[int, float, int]:
    """`solve` with plain arrays for its tuples."""
    chain = Chain(lengths, tool, limits, coupling)
    return solve(chain, Goal(kind, point, rotation, prior), q, max_iterations, tolerance)


@njit(cache=True)
def _unit_problem(chain: Chain, goal: Goal, total: float, shrink: float, rows: Array) -> Problem:
    """The problem with the digit's length, total, as the unit; its arrays are rows (3, 4).

    shrink: factor by which the target moves towards the root.
    """
    bones, point = rows[:2], rows[2]
    for i in range(3):
        bones[0, i] = chain.lengths[i] / total
        bones[1, i] = chain.tool[i] / total
        point[i] = goal.point[i] * (shrink / total)
    return Problem(goal.kind, bones, chain.limits, chain.coupling, point, goal.rotation, goal.prior)


@njit(cache=True)
def _leave_singularity(problem: Problem, q: Array) -> None:
    """Bend a straight digit (q in place) about as much as its target's distance needs.

    The distance from root to tip does not change at first when a straight digit bends: its Jacobian
    says that bending is useless, and a digit straight at its limits stays so. To second order, with
    the digit's length 1, 1 - d^2 = K * second flexion^2.
    """
    distance = norm(problem.point)
    if abs(q[2]) + abs(q[3]) > _STRAIGHT_RAD or distance >= 1.0:
        return
    bones, r = problem.bones, problem.coupling[0]
    a, b, c = bones[0, 0], bones[0, 1], norm(bones[1])
    stiffness = a * b + r * r * b * c + (1.0 + r) ** 2 * a * c
    bend = min(math.sqrt((1.0 - distance * distance) / max(stiffness, 1e-6)), 1.0)
    if bend > abs(q[2]):
        q[2], q[3] = bend, r * bend
        clamp_to_limits(q, problem.limits)


@njit(cache=True)
def _restart_posture(limits: Array, restart: int, q: Array) -> None:
    """Fill q (4,) with one of _RESTART_POSTURES."""
    for j in range(4):
        q[j] = limits[j, 0] + _RESTART_POSTURES[restart, j] * (limits[j, 1] - limits[j, 0])
