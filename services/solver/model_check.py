"""Whether a hand model can be solved with: a calibration file may have been written by hand."""

from __future__ import annotations

import numpy as np

from rhot.errors import CalibrationError
from rhot.hand import DIGITS, TIPS, Digit, HandModel


def check_model(model: HandModel) -> None:
    """Everything that the kernels rely on; raises CalibrationError that names the file."""
    where = f"hand.{model.hand}.json"
    missing = sorted({"wrist", *TIPS} - set(model.paint))
    if missing:
        raise CalibrationError(
            f"{where}: no paint for {missing}; run `rhot calibrate hand` or copy the tables' hand"
        )
    for digit in model.digits:
        _check_digit(where, digit)
    if [digit.name for digit in model.digits] != list(DIGITS):
        raise CalibrationError(f"{where}: digits must be {', '.join(DIGITS)} in this order")


def _check_digit(where: str, digit: Digit) -> None:
    numbers = np.array(
        [
            *digit.metacarpal_m,
            *digit.base_m,
            *digit.base_wxyz,
            *digit.lengths_m,
            digit.coupling,
            digit.coupling_weight,
        ]
    )
    has_direction = np.linalg.norm(digit.base_wxyz) > 1e-6
    if not (np.all(np.isfinite(numbers)) and has_direction and digit.coupling_weight >= 0.0):
        raise CalibrationError(
            f"{where}: {digit.name} has a number that is not finite, no direction, "
            "or a negative weight"
        )
    limits = np.array(digit.limits_rad)
    if not (np.all(np.abs(limits) <= np.pi) and np.all(limits[:, 0] <= limits[:, 1])):
        raise CalibrationError(
            f"{where}: limits_rad of {digit.name} must be (low, high) pairs in radians, "
            "low <= high, within -pi..pi"
        )
