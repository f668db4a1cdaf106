"""The angles of each digit, given the wrist's pose, by the method that rig.toml names.

The whole-hand estimate says where the wrist is and how every digit is about bent. The method then
brings each painted tip to where it was seen, starting from there. A digit whose tip was not seen
keeps the whole-hand estimate and is `predicted`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot.files.rig_tables import Solver
from rhot.geometry.transforms import Array
from rhot.hand import DIGITS
from services.solver.finger import analytic, dls, dls_paper, fabrik, fabrik_paper
from services.solver.finger.outcome import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.finger.swing_limits import BOX
from services.solver.maths.chains import Chain, HandChains, canonical_from_wrist, digit_chain
from services.solver.maths.joint_limits import clamp_to_limits
from services.solver.maths.kinematics import tip_rotation

# Iterations, distance left (m), outcome.
Ending = tuple[int, float, int]
Status = Literal["solved", "unreachable", "not_converged", "predicted"]
STATUS_OF: dict[int, Status] = {
    SOLVED: "solved",
    UNREACHABLE: "unreachable",
    NOT_CONVERGED: "not_converged",
}

# rad; how far dls trusts the whole-hand estimate's angles, against how far it trusts the painted
# tip. A tip fixes three of four angles, and in a fist, when it lies on the axis of abduction, two:
# without this prior they jump with a millimetre of noise. Simulated hands, 1 mm, middle knuckle
# painted: flexion error 2.31 deg at 0.25, 2.24 at 0.1, 2.20 at 0.03, where tips lag behind.
_PRIOR_SIGMA_RAD = 0.1
# A tip is reached when it is as near as its own uncertainty allows: 3 standard deviations.
_REACHED_SIGMAS = 3.0
# No camera sees that far; what is not a number is not within it either.
_MAX_RANGE_M = 1e3


@dataclass(frozen=True)
class TipObservation:
    """A painted tip."""

    point_m: Array  # (3,) wrist frame
    sigma_m: float  # one standard deviation
    measured: bool  # whether a camera saw it; else fusion predicted it


@dataclass(frozen=True)
class FingerSolution:
    """All digits, in the order of DIGITS."""

    angles_rad: Array  # (5, 4) within limits
    residual_m: list[float]  # distance left between painted tip and where it was seen
    iterations: list[int]
    status: list[Status]


def solve_fingers(
    settings: Solver, chains: HandChains, start_rad: Array, tips: Mapping[str, TipObservation]
) -> FingerSolution:
    """Bring the painted tips (by digit) to where they were seen.

    Starts from the whole hand's angles start_rad (5, 4). Tips that no camera saw in this frame are
    solved for too, but called predicted. Points out of any camera's range are not tips.
    """
    tips = {name: tip for name, tip in tips.items() if np.all(np.abs(tip.point_m) < _MAX_RANGE_M)}
    angles = start_rad.copy()
    clamp_to_limits(angles.reshape(-1), chains.limits_rad.reshape(-1, 2))
    targets = _targets(chains, tips)
    ends = np.zeros((5, 3))  # iterations, metres left, outcome
    if settings.method == "dls":
        dls.solve_digits(
            chains, targets, angles, settings.max_iterations, settings.tolerance_m, ends
        )
    else:
        for row in np.flatnonzero(targets.measured).tolist():
            ends[row] = _solve_digit(settings, chains, row, targets.points_m[row], angles[row])
    status = [
        _status(tips.get(name), ends[row], settings.tolerance_m) for row, name in enumerate(DIGITS)
    ]
    iterations = [int(count) for count in ends[:, 0]]
    return FingerSolution(angles, ends[:, 1].tolist(), iterations, status)


def _targets(chains: HandChains, tips: Mapping[str, TipObservation]) -> dls.TipTargets:
    """The tips as arrays, and how strongly each digit's angles stay near the whole hand's."""
    points, measured, sigma = np.zeros((5, 3)), np.zeros(5, np.int64), np.zeros(5)
    for row, name in enumerate(DIGITS):
        if name in tips:
            points[row], measured[row], sigma[row] = tips[name].point_m, 1, tips[name].sigma_m
    lengths_m = np.maximum(chains.lengths_m.sum(axis=1), 1e-3)
    return dls.TipTargets(points, measured, sigma / (_PRIOR_SIGMA_RAD * lengths_m))


def _status(tip: TipObservation | None, end: Array, tolerance_m: float) -> Status:
    """What became of a digit; end (3,) is (iterations, metres left, outcome)."""
    if tip is None or not tip.measured:
        return "predicted"
    reached = end[1] <= max(tolerance_m, _REACHED_SIGMAS * tip.sigma_m)
    return "solved" if reached else STATUS_OF[int(end[2])]


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
