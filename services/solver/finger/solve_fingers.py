"""The angles of each digit, given the wrist's pose, by the method that rig.toml names.

The whole-hand estimate says where the wrist is and how every digit is about bent. The method then
brings each painted tip to where it was seen, starting from there. A digit whose tip was not seen
keeps the whole-hand estimate and is `predicted`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.files.rig_tables import Solver
from rhot.geometry.transforms import Array
from services.solver.finger import analytic, dls, dls_paper, fabrik, fabrik_paper
from services.solver.finger.outcome import NOT_SEEN, SOLVED
from services.solver.finger.swing_limits import BOX
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import Chain, HandChains, canonical_from_wrist, digit_chain
from services.solver.maths.joint_limits import clamp_to_limits
from services.solver.maths.kinematics import tip_rotation

Bools = npt.NDArray[np.bool_]
# Of a tip: nobody saw it, fusion predicted it, a camera saw it.
NOBODY, PREDICTED, MEASURED = 0, 1, 2
# Iterations, distance left (m), outcome.
Ending = tuple[int, float, int]
# The method that solves all digits at once, compiled.
DLS = "dls"

# rad; how far dls trusts the whole-hand estimate's angles, against how far it trusts the painted
# tip. A tip fixes three of four angles, and in a fist, when it lies on the axis of abduction, two:
# without this prior they jump with a millimetre of noise. Simulated hands, 1 mm, middle knuckle
# painted: flexion error 2.31 deg at 0.25, 2.24 at 0.1, 2.20 at 0.03, where tips lag behind.
_PRIOR_SIGMA_RAD = 0.1
# A tip is reached when it is as near as its own uncertainty allows: 3 standard deviations.
_REACHED_SIGMAS = 3.0
# No camera sees that far; what is not a number is not within it either.
_MAX_RANGE_M = 1e3


class Tips(NamedTuple):
    """Painted tips of all digits, in the order of DIGITS."""

    points_m: Array  # (5, 3) wrist frame
    sigma_m: Array  # (5,) one standard deviation
    seen: Integers  # (5,) NOBODY, or who saw it


class FingerSolution(NamedTuple):
    """All digits, in the order of DIGITS."""

    angles_rad: Array  # (5, 4) within limits
    # (5, 3) iterations, distance left between painted tip and where it was seen, and outcome.
    ends: Array
    status: Integers  # (5,) codes of outcome.py


@njit(cache=True)
def tips_in_wrist(
    wrist: tuple[Array, Array], landmarks: tuple[Integers, Array, Array, Bools]
) -> Tips:
    """The tips among m landmarks in the frame of a wrist (rotation (3, 3), position (3,)).

    landmarks: digits (m,) whose tip each is, -1 of the others; points (m, 3), covariances (m, 3, 3)
    and who was measured (m,) in the rig frame, as landmarks.Observed has them.
    """
    (rotation, position_m), (digits, points_m, covariances_m2, measured) = wrist, landmarks
    tips = Tips(np.zeros((5, 3)), np.zeros(5), np.full(5, NOBODY))
    for n in range(digits.size):
        row = digits[n]
        if row >= 0:
            trace = 0.0
            for i in range(3):
                trace += covariances_m2[n, i, i]
                # Row i of the rotation turned over.
                for k in range(3):
                    way_m = points_m[n, k] - position_m[k]
                    tips.points_m[row, i] += rotation[k, i] * way_m
            tips.sigma_m[row] = math.sqrt(trace / 3.0)
            tips.seen[row] = MEASURED if measured[n] else PREDICTED
    return tips


def solve_fingers(
    settings: Solver, chains: HandChains, start_rad: Array, tips: Tips
) -> FingerSolution:
    """Bring the painted tips to where they were seen.

    Starts from the whole hand's angles start_rad (5, 4). Tips that no camera saw in this frame are
    solved for too, but called predicted. Points out of any camera's range are not tips.
    """
    if settings.method == DLS:
        found: FingerSolution = solve_dls(
            chains, start_rad, tips, settings.max_iterations, settings.tolerance_m
        )
        return found
    angles, ends = start_rad.copy(), np.zeros((5, 3))
    clamp_to_limits(angles.reshape(-1), chains.limits_rad.reshape(-1, 2))
    targets = _targets(chains.lengths_m, tips)
    for row in np.flatnonzero(targets.measured).tolist():
        ends[row] = _solve_digit(settings, chains, row, targets.points_m[row], angles[row])
    return FingerSolution(angles, ends, _statuses(tips, targets, ends, settings.tolerance_m))


@njit(cache=True)
def solve_dls(
    chains: HandChains, start_rad: Array, tips: Tips, max_iterations: int, tolerance_m: float
) -> FingerSolution:
    """`solve_fingers` by damped least squares, for kernels."""
    angles, ends = start_rad.copy(), np.zeros((5, 3))
    for row in range(5):
        clamp_to_limits(angles[row], chains.limits_rad[row])
    targets = _targets(chains.lengths_m, tips)
    dls.solve_digits(chains, targets, angles, max_iterations, tolerance_m, ends)
    return FingerSolution(angles, ends, _statuses(tips, targets, ends, tolerance_m))


@njit(cache=True)
def _targets(lengths_m: Array, tips: Tips) -> dls.TipTargets:
    """The tips within range, and how strongly each digit's angles stay near the whole hand's."""
    points_m, sigma_m, seen = tips
    targets = dls.TipTargets(np.zeros((5, 3)), np.zeros(5, np.int64), np.zeros(5))
    for row in range(5):
        in_range = seen[row] != NOBODY
        for i in range(3):
            in_range &= abs(points_m[row, i]) < _MAX_RANGE_M
        if in_range:
            targets.points_m[row] = points_m[row]
            targets.measured[row] = 1
            length_m = max(lengths_m[row, 0] + lengths_m[row, 1] + lengths_m[row, 2], 1e-3)
            targets.prior_weight[row] = sigma_m[row] / (_PRIOR_SIGMA_RAD * length_m)
    return targets


@njit(cache=True)
def _statuses(tips: Tips, targets: dls.TipTargets, ends: Array, tolerance_m: float) -> Integers:
    """What became of the digits; (5,) as in FingerSolution."""
    status = np.full(5, NOT_SEEN)
    for row in range(5):
        if tips.seen[row] == MEASURED and targets.measured[row] != 0:
            reached = ends[row, 1] <= max(tolerance_m, _REACHED_SIGMAS * tips.sigma_m[row])
            status[row] = SOLVED if reached else int(ends[row, 2])
    return status


def _solve_digit(settings: Solver, chains: HandChains, row: int, point: Array, q: Array) -> Ending:
    """One digit by a method other than dls; q (4,) in and out.

    Returns (iterations, distance left, outcome).
    """
    chain = digit_chain(chains, row)
    target = canonical_from_wrist(chains.base_m[row], chains.base_rotation[row], chains.side, point)
    return METHODS[settings.method](settings, chain, target, q)


def _fabrik(settings: Solver, chain: Chain, target: Array, q: Array) -> Ending:
    return fabrik.solve(chain, target, q, BOX, settings.max_iterations, settings.tolerance_m)


def _analytic(settings: Solver, chain: Chain, target: Array, q: Array) -> Ending:
    return analytic.solve(chain, target, q, settings.tolerance_m)


def _fabrik_paper(settings: Solver, chain: Chain, target: Array, q: Array) -> Ending:
    return fabrik_paper.solve(chain, target, q, settings.max_iterations, settings.tolerance_m)


def _dls_paper(settings: Solver, chain: Chain, target: Array, q: Array) -> Ending:
    options = dls_paper.Options(
        max_iterations=settings.max_iterations, tolerance_m=settings.tolerance_m
    )
    found = dls_paper.solve(chain, target, tip_rotation(q), q, options)
    q[:] = found.angles_rad
    return found.iterations, found.residual_m, found.outcome


# Methods that solve one digit at a time, by their name in rig.toml; `dls` solves all at once. Each
# changes the angles q (4,) in place and keeps them within the chain's limits; docs/extend.md shows
# how to add one.
METHODS: dict[str, Callable[[Solver, Chain, Array, Array], Ending]] = {
    "fabrik": _fabrik,
    "analytic": _analytic,
    "fabrik-paper": _fabrik_paper,
    "dls-paper": _dls_paper,
}
