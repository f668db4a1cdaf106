"""What is believed of a hand after a message, and how far two such beliefs lie apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from services.solver.maths.rotation_vectors import rotation_vector


@dataclass(frozen=True)
class HandEstimate:
    """The hand after one message."""

    rotation: Array  # (3, 3) wrist in the rig frame
    position_m: Array  # (3,)
    angles_rad: Array  # (5, 4) within limits
    covariance: Array  # (26, 26) of rotation, position and angles (rad, m)
    cost: float  # squared standard deviations
    iterations: int


def offset(a: HandEstimate, b: HandEstimate) -> Array:
    """b - a in the order of the unknowns: rotation vector, position, angles; (26,)."""
    turn = rotation_vector(b.rotation @ a.rotation.T)
    return np.concatenate(
        [turn, b.position_m - a.position_m, (b.angles_rad - a.angles_rad).ravel()]
    )
