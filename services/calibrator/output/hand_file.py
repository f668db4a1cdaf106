"""hand.<hand>.json: a calibrated hand with how it came about. Pure."""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.hand import DIGITS, Digit, HandModel
from services.calibrator.hand.adjust import Adjustment
from services.calibrator.hand.free_motion.estimate import Estimate
from services.calibrator.hand.free_motion.frames import Seen
from services.calibrator.hand.lengths import Length, estimated_lengths
from services.calibrator.hand.problem import Problem

# Of the frames that showed a bend, as many percent are taken as right; the rest may be wrong.
_REACHED_PERCENTILE = 99
# No joint bends further, deg.
_MAX_BEND_DEG = 130.0


class HandFile(HandModel, frozen=True, kw_only=True):
    """The model that solver and fusion read, and how it came about."""

    inputs: str = ""
    frames: int = 0
    residual_m: float = 0.0
    lengths: list[Length] = msgspec.field(default_factory=list)
    # Largest angles the exercises showed, deg: of each finger at the knuckle and at its middle
    # joint.
    reached_deg: dict[str, float] = msgspec.field(default_factory=dict)
    # Of free motion: size against the average adult's, how well each knuckle is known, for how long
    # the hand was seen, and fingers that were not bent.
    size: float = 0.0
    knuckle_sigma_m: dict[str, float] = msgspec.field(default_factory=dict)
    seconds: float = 0.0
    not_bent: list[str] = msgspec.field(default_factory=list)


def hand_file(
    problem: Problem, found: Adjustment, table: HandModel, *, date: str, inputs: str
) -> HandFile:
    """Everything that goes into the file; estimates are compared with the hand table."""
    parameters = problem.parameters
    model = parameters.model(found.x)
    distances = found.equations.distances
    # Whitened distances back to metres, per coordinate.
    weights = np.maximum(problem.weights.mean(axis=2), 1.0)
    residual_m = float(np.sqrt((distances**2 / weights).mean() / 3.0))
    reached = _reached_deg(problem, found)
    fields = {name: getattr(model, name) for name in model.__struct_fields__}
    return HandFile(
        **fields
        | {
            "digits": tuple(_widened(digit, reached) for digit in model.digits),
            "origin": "measured",
            "date": date,
            "tool": "rhot calibrate hand",
            "inputs": inputs,
            "frames": len(distances),
            "residual_m": round(residual_m, 6),
            "lengths": estimated_lengths(parameters, found.x, found.covariance, table),
            "reached_deg": reached,
        }
    )


def free_hand_file(
    found: Estimate, seen: Seen, table: HandModel, *, date: str, inputs: str
) -> HandFile:
    """The same of free motion, which has no exercises."""
    model = found.model
    sigmas = zip(DIGITS[1:], found.knuckle_sigmas_m().tolist(), strict=True)
    return HandFile(
        **{name: getattr(model, name) for name in model.__struct_fields__}
        | {
            "origin": "measured",
            "date": date,
            "tool": "rhot calibrate hand",
            "inputs": inputs,
            "frames": len(seen.frames.points),
            "residual_m": round(found.residual_m, 6),
            "lengths": estimated_lengths(found.parameters, found.x, found.covariance, table),
            "size": round(found.size, 4),
            "knuckle_sigma_m": {digit: round(sigma, 6) for digit, sigma in sigmas},
            "seconds": round(seen.seconds, 1),
            "not_bent": list(seen.not_bent),
        }
    )


def _reached_deg(problem: Problem, found: Adjustment) -> dict[str, float]:
    """Largest bends, deg, by exercise."""
    reached = {}
    for number, segment in enumerate(problem.segments):
        if segment.name.endswith(("_knuckle", "_hook")):
            # The first varying angle of these segments is the exercised one.
            bends = found.poses.varying[problem.segment_of == number, 0]
            largest = np.rad2deg(np.percentile(bends, _REACHED_PERCENTILE))
            reached[segment.name.replace("_", " ")] = round(float(largest), 1)
    return reached


def _widened(digit: Digit, reached: dict[str, float]) -> Digit:
    """Limits grow to what was reached.

    What was not asked to its end says nothing, so they never shrink.
    """
    limits = list(digit.limits_rad)
    for column, kind in ((1, "knuckle"), (2, "hook")):
        low, high = limits[column]
        bend = np.deg2rad(min(reached.get(f"{digit.name} {kind}", 0.0), _MAX_BEND_DEG))
        limits[column] = (low, round(float(max(high, bend)), 6))
    return msgspec.structs.replace(digit, limits_rad=tuple(limits))
