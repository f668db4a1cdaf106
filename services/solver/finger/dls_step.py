"""The damped, box-constrained Gauss-Newton iteration of one digit, from one start.

- The damping is mu = 0.01 |e|^2 + 1e-15: quadratic convergence near the goal (Fan & Yuan 2005),
  caution far from it.
- The step minimises its quadratic model *within the limits* (box_qp): clipping a free step
  afterwards stalls at limits.
- The best iterate is kept.

Functions that take a tuple of arrays are inlined by force: numba counts the references to each
array of the tuple at each call, which cost a fifth of a digit's time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import unowned
from services.solver.finger.dls_equations import Problem, normal_equations
from services.solver.maths.box_qp import Integers, Workspace, box_qp
from services.solver.maths.cholesky import newton_step4

# rad; moves a tip by less than 1e-5 mm: with a coupling that cannot be met this is where it ends.
MIN_STEP_RAD = 1e-7
# A step that came out worse is not taken back (going on from there leaves traps), but the next ones
# are damped this much more: without it a target out of reach has the digit swing between its
# limits.
_DAMPING_GROWTH = 10.0


class Memory(NamedTuple):
    """What `iterate` works in: two allocations a digit, since each costs time."""

    rows: Array  # (14, 4) or more
    integers: Integers  # (2, 4)


class StepProblem(NamedTuple):
    """One step as a quadratic programme: min 1/2 x'Hx + g'x, low <= x <= high."""

    H: Array  # (4, 4) J'J, with damping once a step is computed
    g: Array  # (4,) -J'e
    low: Array  # (4,) bounds of the step, rad
    high: Array  # (4,)
    step: Array  # (4,) its solution
    work: Workspace


@njit(cache=True, inline="always")
def _step_problem(memory: Memory) -> StepProblem:
    """The arrays of a StepProblem as views of the memory."""
    rows, integers = memory.rows, memory.integers
    work = Workspace(L=rows[8:12], step=rows[12], state=integers[0], free=integers[1])
    return StepProblem(rows[:4], rows[4], rows[5], rows[6], rows[7], work)


@njit(cache=True)
def iterate(
    problem: Problem, q: Array, max_iterations: int, tolerance: float, memory: Memory
) -> tuple[int, float, float]:
    """One start: improve q (4,) in place until the residual is at `tolerance` (digit lengths).

    Returns the iterations up to the best iterate, its cost and its distance from the target.
    """
    problem, q, memory = unowned((problem, q, memory))
    qp, best = _step_problem(memory), memory.rows[13]
    best_cost, best_distance, best_iteration = np.inf, np.inf, 0
    largest, damping_scale = 1.0, 1.0
    for iteration in range(max_iterations + 1):
        cost, distance = normal_equations(problem, q, qp.H, qp.g)
        if cost < best_cost:
            best_cost, best_distance, best_iteration = cost, distance, iteration
            for a in range(4):
                best[a] = q[a]
            damping_scale = max(0.1 * damping_scale, 1.0)
        else:
            damping_scale *= _DAMPING_GROWTH
        # The last step is taken and judged: breaking before that would leave up to 1e-7 rad on the
        # table.
        if cost < tolerance * tolerance or largest < MIN_STEP_RAD:
            break
        if not _damped_step(qp, problem.limits, q, damping_scale * 0.01 * cost + 1e-15):
            break
        largest = _apply_step(problem.limits, q, qp.step)
    if best_iteration < iteration:
        for a in range(4):
            q[a] = best[a]
    return best_iteration, best_cost, best_distance


@njit(cache=True, inline="always")
def _damped_step(qp: StepProblem, limits: Array, q: Array, damping: float) -> bool:
    """The step that minimises the damped model within the limits, into qp.step.

    False where H is not definite.
    """
    for a in range(4):
        qp.H[a, a] += damping
        qp.low[a] = limits[a, 0] - q[a]
        qp.high[a] = limits[a, 1] - q[a]
    inside = newton_step4(qp.H, qp.g, qp.step)
    for a in range(4):
        inside &= qp.low[a] <= qp.step[a] <= qp.high[a]
    return inside or box_qp(qp.H, qp.g, qp.low, qp.high, qp.step, qp.work)


@njit(cache=True)
def _apply_step(limits: Array, q: Array, step: Array) -> float:
    """Move q (4,) by the step, within the limits; returns the largest of its parts."""
    largest = 0.0
    for a in range(4):
        q[a] = min(max(q[a] + step[a], limits[a, 0]), limits[a, 1])
        largest = max(largest, abs(step[a]))
    return largest
