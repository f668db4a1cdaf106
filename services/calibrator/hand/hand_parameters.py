"""What differs between two people's hands, as a vector of unknowns that each have the standard
deviation 1 before the first look.

x = 0 is the hand of the tables at some size. An unknown's prior is the spread of the population, so
a posterior standard deviation of 1 means "the recording said nothing of this, it is the table's",
and 0.1 "ten times better known than by the table". Lengths that were measured by hand are no
unknowns. A model without paint for a named landmark is the caller's error (KeyError).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
    skew,
)
from rhot.hand import CHAIN_JOINTS, DIGITS, JOINT_INDEX, TIPS, HandModel

# Spread (standard deviation over mean) of the bones of one size of hand: Buryanov & Kotiuk 2010 (n
# = 66) give these over all sizes, 0.07 to 0.15; hand length over both sexes spreads by 0.065, which
# is SIZE's part. At least 0.06, for X-rays measure well.
BONE_SD = (
    (0.06, 0.073, 0.06),
    (0.104, 0.091, 0.131),
    (0.06, 0.093, 0.088),
    (0.068, 0.110, 0.109),
    (0.06, 0.122, 0.142),
)
METACARPAL_SD = (0.06, 0.067, 0.06, 0.06, 0.06)
# About the size that the open hand showed, which itself is good to a few percent.
SIZE_SD = 0.10
# Where the first joint of a chain sits beside its metacarpal's direction; the thumb's saddle joint
# in all directions. People differ by more, but how the wrist's frame lies in the hand is a
# convention: free by 1.5 and 3 mm (and 2 mm of the wrist's paint) it tilts, and the orientation
# error of the solver was 1.3 instead of 1.2 times that with true bones.
_ACROSS_M, _THUMB_BASE_M = 0.0007, 0.002
# How a chain's straight posture may be turned about its axis of abduction and about its bone, rad.
# Tight: wrist and tips hardly show it, and a finger whose roll is wrong by 6 deg doubles the
# solver's error, so that guessing is worse than the table.
_TURN_SD, _THUMB_TURN_SD = np.deg2rad([1.5, 1.0]), np.deg2rad([3.0, 3.0])
# Where a dab of paint is put; the wrist's is part of the convention above. A dipped tip is painted
# all round: its middle is on the bone's axis (first two coordinates) but for cameras' views, 0.3
# radii in the worst case.
_WRIST_PAINT_M, _PAINT_M, _TIP_PAINT_M = (
    (0.001, 0.001, 0.001),
    (0.002, 0.002, 0.002),
    (0.0005, 0.0005, 0.002),
)
# DIP/PIP of real hands: .68-.74 in strong flexion, less when relaxed (finger study, Fig. 7).
_COUPLING_SD = 0.05

SIZE, BONES, BASES, TURNS, PAINT = 0, slice(1, 16), slice(16, 31), slice(31, 41), 41


class Geometry(NamedTuple):
    """A person's measures in metres, and how they change with the unknowns.

    G has one row per measure: lengths (15), bases (15), metacarpals (15), turns of the chains in
    the wrist frame (15 rotation vectors' coordinates), offsets (3 per landmark), coupling ratios
    (5).
    """

    lengths: Array  # (5, 3)
    bases: Array  # (5, 3)
    metacarpals: Array  # (5, 3)
    rotations: Array  # (5, 3, 3)
    offsets: Array  # (m, 3)
    ratios: Array  # (5,)
    G: Array  # (60 + 3 m + 5, unknowns)


class Shape:
    """The unknowns of one person seen through some landmarks."""

    def __init__(
        self,
        table: HandModel,
        names: Sequence[str],
        lengths_m: Mapping[tuple[int, int], float] | None = None,
    ) -> None:
        """table: the hand at x = 0; names: landmarks in the recording.

        Lengths_m: (digit, bone) -> metres measured by hand.
        """
        self.table, self.names = table, tuple(names)
        self.known = dict(lengths_m or {})
        self.unknowns = PAINT + 3 * len(self.names) + 5
        self.measures = 60 + 3 * len(self.names) + 5
        # Of each landmark: row of its chain and place in it; (-1, 0) wrist, (-1, 1) palm, (-2, row)
        # start of a metacarpal.
        self.places = [_place(name) for name in self.names]
        self._lengths = table.lengths_m
        self._metacarpals = np.array([digit.metacarpal_m for digit in table.digits])
        self._bases = np.array([digit.base_m for digit in table.digits])
        self._rotations = np.array(
            [rotation_from_quaternion(digit.base_wxyz) for digit in table.digits]
        )
        self._offsets = np.array([table.paint[name].offset_m for name in self.names])
        sds = [
            _WRIST_PAINT_M if name == "wrist" else _TIP_PAINT_M if name in TIPS else _PAINT_M
            for name in self.names
        ]
        self._paint_sd = np.array(sds)
        # Paint on a tip reaches as far from its end on every hand.
        self._grows = np.array([name not in TIPS for name in self.names])

    def geometry(self, x: Array) -> Geometry:
        """The measures of the person x (unknowns,)."""
        G = np.zeros((self.measures, self.unknowns))
        size = float(np.exp(SIZE_SD * x[SIZE]))
        lengths = self._grown(x, size, G)
        bases = np.array([self._base(row, x, size, G) for row in range(5)])
        metacarpals = size * self._metacarpals
        metacarpals[0] = bases[0]
        G[33:45, SIZE] = SIZE_SD * metacarpals[1:].ravel()
        G[30:33] = G[15:18]
        rotations = np.array([self._turned(row, x, G) for row in range(5)])
        factor = np.where(self._grows, size, 1.0)[:, None]
        count = 3 * len(self.names)
        offsets = factor * self._offsets + self._paint_sd * x[PAINT : PAINT + count].reshape(-1, 3)
        G[60 : 60 + count, SIZE] = (SIZE_SD * size * self._grows[:, None] * self._offsets).ravel()
        G[60 : 60 + count, PAINT : PAINT + count] = np.diag(self._paint_sd.ravel())
        ratios = np.array([digit.coupling for digit in self.table.digits]) + _COUPLING_SD * x[-5:]
        G[-5:, -5:] = _COUPLING_SD * np.eye(5)
        return Geometry(lengths, bases, metacarpals, rotations, offsets, ratios, G)

    def model(self, x: Array) -> HandModel:
        """The person x as a hand model.

        Limits and what was not looked at are the table's, at the person's size.
        """
        found, size = self.geometry(x), float(np.exp(SIZE_SD * x[SIZE]))
        digits = tuple(
            msgspec.structs.replace(
                digit,
                lengths_m=_vector(found.lengths[row]),
                base_m=_vector(found.bases[row]),
                metacarpal_m=_vector(found.metacarpals[row]),
                base_wxyz=tuple(
                    np.round(quaternion_from_rotation(found.rotations[row]), 9).tolist()
                ),
                radii_m=_vector(size * np.array(digit.radii_m)),
                coupling=round(float(found.ratios[row]), 4),
            )
            for row, digit in enumerate(self.table.digits)
        )
        paint = {}
        for name, dab in self.table.paint.items():
            offset = (1.0 if name in TIPS else size) * np.array(dab.offset_m)
            if name in self.names:
                offset = found.offsets[self.names.index(name)]
            paint[name] = msgspec.structs.replace(
                dab, offset_m=_vector(offset), radius_m=round(size * dab.radius_m, 6)
            )
        radii = {
            name: round(size * getattr(self.table, name), 6)
            for name in ("wrist_radius_m", "palm_radius_m")
        }
        return msgspec.structs.replace(self.table, digits=digits, paint=paint, **radii)

    def _grown(self, x: Array, size: float, G: Array) -> Array:
        own = np.array(BONE_SD)
        lengths = self._lengths * size * np.exp(own * x[BONES].reshape(5, 3))
        for row in range(5):
            for bone in range(3):
                if (row, bone) in self.known:
                    lengths[row, bone] = self.known[row, bone]
                else:
                    G[3 * row + bone, SIZE] = SIZE_SD * lengths[row, bone]
                    G[3 * row + bone, 1 + 3 * row + bone] = own[row, bone] * lengths[row, bone]
        return lengths

    def _base(self, row: int, x: Array, size: float, G: Array) -> Array:
        """Root of a chain: along its metacarpal by the population's spread, across by millimetres."""
        own = x[16 + 3 * row : 19 + 3 * row]
        if row == 0:
            spread = _THUMB_BASE_M * np.eye(3)
            base = self._bases[0] + spread @ own
        else:
            along = self._bases[row] - self._metacarpals[row]
            length = float(np.linalg.norm(along))
            forward = along / length if length > 0.0 else np.array([0.0, 0.0, -1.0])
            side = np.cross(forward, [0.0, 1.0, 0.0])
            side /= np.linalg.norm(side)
            length *= float(np.exp(METACARPAL_SD[row] * own[0]))
            across = _ACROSS_M * np.stack([side, np.cross(side, forward)], axis=1)
            base = self._metacarpals[row] + length * forward + across @ own[1:]
            spread = np.column_stack([METACARPAL_SD[row] * length * forward, across])
        G[15 + 3 * row : 18 + 3 * row, SIZE] = SIZE_SD * size * base
        G[15 + 3 * row : 18 + 3 * row, 16 + 3 * row : 19 + 3 * row] = size * spread
        return size * base

    def _turned(self, row: int, x: Array, G: Array) -> Array:
        rest = self._rotations[row]
        axes = rest[:, 1:] * (_THUMB_TURN_SD if row == 0 else _TURN_SD)  # (3, 2): abduction, bone
        turn = axes @ x[31 + 2 * row : 33 + 2 * row]
        G[45 + 3 * row : 48 + 3 * row, 31 + 2 * row : 33 + 2 * row] = _left_jacobian(turn) @ axes
        return rotation_from_vector(turn) @ rest


def _place(name: str) -> tuple[int, int]:
    joint = JOINT_INDEX[name]
    found = np.argwhere(joint == CHAIN_JOINTS)
    if len(found):
        return int(found[0][0]), int(found[0][1])
    if name in ("wrist", "palm"):
        return -1, int(name == "palm")
    return -2, DIGITS.index(name.removesuffix("_metacarpal"))


def _left_jacobian(turn: Array) -> Array:
    """J with exp(turn + J^-1 w) = exp(w) exp(turn) to first order in w (Sola et al. 2018, eq.

    145); (3,) -> (3, 3).
    """
    angle = float(np.linalg.norm(turn))
    cross = skew(turn)
    if angle < 1e-4:
        return np.eye(3) + 0.5 * cross + cross @ cross / 6.0
    return (
        np.eye(3)
        + (1.0 - np.cos(angle)) / angle**2 * cross
        + (angle - np.sin(angle)) / angle**3 * (cross @ cross)
    )


def _vector(values: Array) -> tuple:  # micrometres
    return tuple(np.round(values, 6).tolist())
