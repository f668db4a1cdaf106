"""A board that somebody carries from place to place and holds still there. Pure.

Where it is follows from time alone once it was told where to go; a camera's thread that reads it
while it is told sees the old leg or the new one, never half of either.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import (
    Array,
    rotation_from_vector,
    transform,
    vector_from_rotation,
)
from services.simulator.board.sheet import BoardKind
from services.simulator.hands.gestures import smootherstep

# From one place to the next, s: as a person does it who does not dawdle, at up to .6 m/s.
_MOVE_S = 0.7


class _Leg(NamedTuple):
    """From one pose T_rig_from_board to another, beginning at that scene time."""

    begins_s: float
    T_from: Array  # (4, 4)
    T_to: Array  # (4, 4)


class CarriedBoard:
    """A board in somebody's hands."""

    def __init__(self, kind: BoardKind, T_rig_from_board: Array) -> None:
        """It is held where it is."""
        self.kind: BoardKind = kind
        self._leg = _Leg(0.0, T_rig_from_board, T_rig_from_board)

    def carry(self, T_rig_from_board: Array, t_s: float) -> None:
        """From t_s on it is carried there, from wherever it is then."""
        self._leg = _Leg(t_s, self.pose(t_s), T_rig_from_board)

    def pose(self, t_s: float) -> Array:
        """T_rig_from_board (4, 4)."""
        leg = self._leg
        share = smootherstep(min(max((t_s - leg.begins_s) / _MOVE_S, 0.0), 1.0))
        turn = vector_from_rotation(leg.T_from[:3, :3].T @ leg.T_to[:3, :3])
        rotation = leg.T_from[:3, :3] @ rotation_from_vector(share * turn)
        position = (1.0 - share) * leg.T_from[:3, 3] + share * leg.T_to[:3, 3]
        return np.asarray(transform(rotation, position))
