"""The angles of each digit, given the wrist's pose, by the method that rig.toml names.

The whole-hand solution says where the wrist is and how every digit is about bent. The method then
brings each painted tip to where it was seen, starting from there. A digit whose tip was not seen
keeps the whole-hand solution and is `predicted`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot.files.config import Solver
from rhot.geometry.transforms import Array
from rhot.hand import DIGITS
from services.solver.finger import analytic, dls, dls_paper, fabrik, fabrik_paper
from services.solver.finger.swing_limits import BOX
from services.solver.maths.kinematics import Chains, chain_of, tip_rotation, to_canonical
from services.solver.whole_hand.posture_prior import clamp

Status = Literal["solved", "unreachable", "not_converged", "predicted"]
STATES: dict[int, Status] = {
    dls.SOLVED: "solved",
    dls.UNREACHABLE: "unreachable",
    dls.NOT_CONVERGED: "not_converged",
}

# rad; how far dls trusts the whole-hand solution's angles, against how far it trusts the painted
# tip. A tip fixes three of four angles, and in a fist, when it lies on the axis of abduction, two:
# without this they jump with a millimetre of noise. Simulated hands, 1 mm, middle knuckle painted:
# flexion error 2.31 deg at 0.25, 2.24 at 0.1, 2.20 at 0.03, where tips lag behind.
_TRUST_RAD = 0.1
# A tip is reached when it is as near as its own uncertainty allows: 3 standard deviations.
_SIGMAS = 3.0
# No room is a kilometre wide; what is not a number is not within it either.
_ROOM_M = 1e3


@dataclass(frozen=True)
class Tip:
    """A painted tip: where (3,) in the wrist frame, one standard deviation (m), and whether a
    camera saw it.
    """

    point_m: Array
    sigma_m: float
    measured: bool


@dataclass(frozen=True)
class Fingers:
    """All digits: angles (5, 4) rad within limits, distance left (m), iterations, status.

    Lists in the order of DIGITS.
    """

    angles_rad: Array
    residual_m: list[float]
    iterations: list[int]
    status: list[Status]


def solve_fingers(
    settings: Solver, chains: Chains, start_rad: Array, tips: Mapping[str, Tip]
) -> Fingers:
    """Bring the painted tips (by digit) to where they were seen, starting from the whole hand's
    angles start_rad (5, 4).

    Tips that no camera saw in this frame are solved for too, but called predicted. Points that are
    no place in a room are not tips.
    """
    tips = {name: tip for name, tip in tips.items() if np.all(np.abs(tip.point_m) < _ROOM_M)}
    angles = start_rad.copy()
    clamp(angles.reshape(-1), chains.limits_rad.reshape(-1, 2))
    ends = np.zeros((5, 3))
    points, seen = np.zeros((5, 3)), np.zeros(5, np.int64)
    for row, name in enumerate(DIGITS):
        if name in tips:
            points[row], seen[row] = tips[name].point_m, 1
    if settings.method == "dls":
        sigma = np.array([tips[name].sigma_m if name in tips else 0.0 for name in DIGITS])
        keep = sigma / (_TRUST_RAD * np.maximum(chains.lengths_m.sum(axis=1), 1e-3))
        dls.solve_digits(
            chains, points, angles, keep, settings.max_iterations, settings.tolerance_m, seen, ends
        )
    else:
        for row in range(5):
            if seen[row]:
                ends[row] = _one(settings, chains, row, points[row], angles[row])
    status = [
        _status(tips.get(name), ends[row], settings.tolerance_m) for row, name in enumerate(DIGITS)
    ]
    return Fingers(angles, ends[:, 1].tolist(), [int(count) for count in ends[:, 0]], status)


def _status(tip: Tip | None, end: Array, tolerance_m: float) -> Status:
    """What became of a digit; end (3,) is (iterations, metres left, state)."""
    if tip is None or not tip.measured:
        return "predicted"
    return "solved" if end[1] <= max(tolerance_m, _SIGMAS * tip.sigma_m) else STATES[int(end[2])]


def _one(
    settings: Solver, chains: Chains, row: int, point: Array, q: Array
) -> tuple[int, float, int]:
    """One digit by a method other than dls; q (4,) in and out.

    Returns (iterations, distance left, state).
    """
    chain = chain_of(chains, row)
    target = to_canonical(chains.base_m[row], chains.base_rotation[row], chains.side, point)
    most, tolerance = settings.max_iterations, settings.tolerance_m
    match settings.method:
        case "fabrik":
            return fabrik.solve(chain, target, q, BOX, most, tolerance)
        case "analytic":
            return analytic.solve(chain, target, q, tolerance)
        case "fabrik-paper":
            return fabrik_paper.solve(chain, target, q, most, tolerance)
        case _:
            frame = dls_paper.solve(
                chain,
                target,
                tip_rotation(q),
                q,
                dls_paper.Reading(most=most, tolerance_m=tolerance),
            )
            q[:] = frame.angles_rad
            return frame.iterations, frame.residual_m, frame.state
