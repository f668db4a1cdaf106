"""The whole hand from its landmarks, as one box-constrained least-squares problem.

Unknowns are the wrist's pose (6) and all angles (20). Wrist and five tips measure 18 numbers; under
RHOT's constraints the hand has 21 degrees of freedom, so the priors on posture and motion (priors/)
say the rest, each weighed by its standard deviation against the landmarks'. Levenberg-Marquardt
with Marquardt's scaling; steps stay within the joint limits (box_qp); Huber weights keep one
outlier from bending the hand. A missing landmark is simply no equation: its finger then follows the
priors. Input that is not finite must not come here (point_check.py drops it).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import unowned
from services.solver.maths.box_qp import Workspace, box_qp, workspace
from services.solver.maths.chains import HandChains
from services.solver.maths.rotation_vectors import apply_rotation_vector
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS, PosePrior
from services.solver.whole_hand.residuals import NormalEquations, Pose, normal_equations

# Iterations of one update: 4 on average, 25 at worst on simulated hands; 30 are 0.2 ms.
MAX_ITERATIONS = 30
# Marquardt's factor: start, and how it moves; the usual values (Madsen, Nielsen & Tingleff 2004,
# section 3.2) made bolder, as the previous pose is nearly always a good start.
_DAMPING_START, _DAMPING_DOWN, _DAMPING_UP = 1e-5, 0.1, 8.0
_DAMPING_MIN, _DAMPING_MAX = 1e-9, 1e6
# Added to the damped diagonal: keeps a direction that nothing measures definite.
_DIAGONAL_FLOOR = 1e-9
# A thousandth of a standard deviation squared is far below what the pose is good for.
_MIN_COST_DECREASE = 1e-3


class Step(NamedTuple):
    """One step of Levenberg-Marquardt as a quadratic programme with bounds (box_qp)."""

    H: Array  # (26, 26) damped
    low: Array  # (26,) bounds of the step
    high: Array  # (26,)
    step: Array  # (26,) rotation vector about the rig's axes, shift, angles


@njit(cache=True)
def fit(
    chains: HandChains,
    observations: Observations,
    prior: PosePrior,
    pose: Pose,
    max_iterations: int,
    information: Array,
) -> tuple[float, int]:
    """Improve the pose in place; returns (cost, iterations). Angles stay within their limits.

    The cost is the sum of squares in standard deviations. information (26, 26) is filled with that
    of the pose found: its inverse is the covariance.
    """
    new_pose = Pose(np.empty((3, 3)), np.empty(3), np.empty((5, 4)))
    memory = _Memory(workspace(UNKNOWNS), _new_step(), new_pose, _new_equations(), _new_equations())
    given = chains, observations, prior
    return _improve(given, pose, max_iterations, information, memory)


class _Memory(NamedTuple):
    """What a fit works in."""

    work: Workspace
    move: Step
    new_pose: Pose
    normal: NormalEquations
    new_normal: NormalEquations


@njit(cache=True)
def _improve(
    given: tuple[HandChains, Observations, PosePrior],
    pose: Pose,
    max_iterations: int,
    information: Array,
    memory: _Memory,
) -> tuple[float, int]:
    """`fit`, with memory to work in."""
    chains, observations, prior = unowned(given)
    pose, information = unowned((pose, information))
    work, move, new_pose, normal, new_normal = unowned(memory)
    cost = normal_equations(chains, observations, prior, pose, normal)
    damping = _DAMPING_START
    used = 0
    while used < max_iterations:
        used += 1
        _damp(chains.limits_rad, pose.angles, normal.H, damping, move)
        if not box_qp(move.H, normal.g, move.low, move.high, move.step, work):
            break
        _apply_step(chains.limits_rad, pose, move.step, new_pose)
        new_cost = normal_equations(chains, observations, prior, new_pose, new_normal)
        if new_cost <= cost:
            converged = cost - new_cost < _MIN_COST_DECREASE * (1.0 + 1e-3 * cost)
            pose.rotation[:] = new_pose.rotation
            pose.position_m[:] = new_pose.position_m
            pose.angles[:] = new_pose.angles
            cost = new_cost
            normal, new_normal = new_normal, normal
            damping = max(damping * _DAMPING_DOWN, _DAMPING_MIN)
            if converged:
                break
        else:
            damping *= _DAMPING_UP
            if damping > _DAMPING_MAX:
                break
    for a in range(UNKNOWNS):
        for b in range(a + 1):
            information[a, b] = information[b, a] = normal.H[a, b]
    return cost, used


@njit(cache=True)
def _new_step() -> Step:
    """The wrist has no bounds."""
    return Step(
        np.empty((UNKNOWNS, UNKNOWNS)),
        np.full(UNKNOWNS, -np.inf),
        np.full(UNKNOWNS, np.inf),
        np.empty(UNKNOWNS),
    )


@njit(cache=True)
def _new_equations() -> NormalEquations:
    return NormalEquations(np.empty((UNKNOWNS, UNKNOWNS)), np.empty(UNKNOWNS))


@njit(cache=True)
def _damp(limits: Array, angles: Array, H: Array, damping: float, move: Step) -> None:
    """Fill the damped matrix, and the bounds that keep angles (5, 4) within limits (5, 4, 2)."""
    move.H[:] = H
    for a in range(UNKNOWNS):
        move.H[a, a] += damping * H[a, a] + _DIAGONAL_FLOOR
    for a in range(20):
        move.low[6 + a] = limits[a // 4, a % 4, 0] - angles[a // 4, a % 4]
        move.high[6 + a] = limits[a // 4, a % 4, 1] - angles[a // 4, a % 4]


@njit(cache=True)
def _apply_step(limits: Array, pose: Pose, step: Array, new: Pose) -> None:
    """Fill `new` with the pose after a step (26,)."""
    new.rotation[:] = apply_rotation_vector(pose.rotation, step[:3])
    new.position_m[:] = pose.position_m + step[3:6]
    for a in range(20):
        limit = limits[a // 4, a % 4]
        angle = pose.angles[a // 4, a % 4] + step[6 + a]
        new.angles[a // 4, a % 4] = min(max(angle, limit[0]), limit[1])
