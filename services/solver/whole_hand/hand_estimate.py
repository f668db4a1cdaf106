"""What is believed of a hand after a message, and how far two such beliefs lie apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.solver.maths.rotation_vectors import turn_between


class HandEstimate(NamedTuple):
    """The hand after one message, in the form in which kernels take it."""

    rotation: Array  # (3, 3) wrist in the rig frame
    position_m: Array  # (3,)
    angles_rad: Array  # (5, 4) within limits
    covariance: Array  # (26, 26) of rotation, position and angles (rad, m)
    cost: float  # squared standard deviations
    iterations: int


def offset(a: HandEstimate, b: HandEstimate) -> Array:
    """b - a in the order of the unknowns: rotation vector, position, angles; (26,)."""
    turn = turn_between(a.rotation, b.rotation)
    return np.concatenate(
        [turn, b.position_m - a.position_m, (b.angles_rad - a.angles_rad).ravel()]
    )
