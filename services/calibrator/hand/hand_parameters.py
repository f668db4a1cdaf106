"""Hand parameters: what differs between two people's hands, as a vector of standardised unknowns.

Each unknown has the prior N(0, 1), scaled by the spread of the population (priors.py), and x = 0 is
the hand of the tables at some size. So a posterior standard deviation of 1 means "the recording
said nothing of this, it is the table's", and 0.1 "ten times better known than by the table".
Lengths that were measured by hand are no unknowns. A model without paint for a named landmark is
the caller's error (KeyError).
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
from services.calibrator.hand.priors import (
    ACROSS_SD_M,
    BONE_SD,
    COUPLING_SD,
    METACARPAL_SD,
    PAINT_SD_M,
    ROTATION_SD,
    SIZE_SD,
    THUMB_BASE_SD_M,
    THUMB_ROTATION_SD,
    TIP_PAINT_SD_M,
    WRIST_PAINT_SD_M,
)

# Columns of the unknowns: one for the size, then those of bones (15), bases (3 a chain), rotations
# (2 a chain), paint (3 a landmark) and, last, coupling ratios (5).
SIZE, BONES, BASE_COLUMNS, ROTATION_COLUMNS, PAINT = 0, slice(1, 16), 16, 31, 41
# First rows of the measures in HandGeometry.G; each chain, bone or landmark has three, and the
# last five rows are the coupling ratios.
LENGTH_ROWS, BASE_ROWS, METACARPAL_ROWS, ROTATION_ROWS, OFFSET_ROWS = 0, 15, 30, 45, 60


def triple(first: int, number: int) -> slice:
    """Three rows of the measures: the number-th of those that begin at first."""
    return slice(first + 3 * number, first + 3 * number + 3)


class HandGeometry(NamedTuple):
    """A hand's measures in metres and in the wrist frame, and their Jacobian G by the unknowns.

    G has one row per measure: lengths (15), bases (15), metacarpals (15), rotations of the chains
    (15 coordinates of rotation vectors in the wrist frame), offsets (3 per landmark), coupling
    ratios (5).
    """

    lengths: Array  # (5, 3)
    bases: Array  # (5, 3)
    metacarpals: Array  # (5, 3)
    rotations: Array  # (5, 3, 3)
    offsets: Array  # (m, 3)
    ratios: Array  # (5,)
    G: Array  # (60 + 3 m + 5, unknowns)


class HandParameters:
    """The unknowns of one hand seen through some landmarks."""

    def __init__(
        self,
        table: HandModel,
        names: Sequence[str],
        lengths_m: Mapping[tuple[int, int], float] | None = None,
    ) -> None:
        """table is the hand at x = 0, names are the landmarks in the recording.

        lengths_m holds what was measured by hand: (digit, bone) -> metres.
        """
        self.table, self.names = table, tuple(names)
        self.known = dict(lengths_m or {})
        self.unknowns = PAINT + 3 * len(self.names) + 5
        self.measures = OFFSET_ROWS + 3 * len(self.names) + 5
        # Of each landmark: its chain's row and its joint's index in it; (-1, 0) wrist, (-1, 1)
        # palm, (-2, row) start of a metacarpal.
        self.joint_of = [_joint_in_chain(name) for name in self.names]
        self._lengths = table.lengths_m
        self._metacarpals = np.array([digit.metacarpal_m for digit in table.digits])
        self._bases = np.array([digit.base_m for digit in table.digits])
        self._rotations = np.array(
            [rotation_from_quaternion(digit.base_wxyz) for digit in table.digits]
        )
        self._offsets = np.array([table.paint[name].offset_m for name in self.names])
        self._paint_sd = np.array([_paint_sd_m(name) for name in self.names])
        # Paint on a tip reaches as far from its end on every hand.
        self._scales = np.array([name not in TIPS for name in self.names])

    def geometry(self, x: Array) -> HandGeometry:
        """The measures of the hand x (unknowns,)."""
        G = np.zeros((self.measures, self.unknowns))
        size = float(np.exp(SIZE_SD * x[SIZE]))
        lengths = self._bone_lengths(x, size, G)
        bases = np.array([self._chain_base(row, x, size, G) for row in range(5)])
        metacarpals = size * self._metacarpals
        # The thumb's metacarpal begins where its chain does.
        metacarpals[0] = bases[0]
        G[METACARPAL_ROWS + 3 : ROTATION_ROWS, SIZE] = SIZE_SD * metacarpals[1:].ravel()
        G[triple(METACARPAL_ROWS, 0)] = G[triple(BASE_ROWS, 0)]
        rotations = np.array([self._chain_rotation(row, x, G) for row in range(5)])
        factor = np.where(self._scales, size, 1.0)[:, None]
        count = 3 * len(self.names)
        offsets = factor * self._offsets + self._paint_sd * x[PAINT : PAINT + count].reshape(-1, 3)
        offset_rows = slice(OFFSET_ROWS, OFFSET_ROWS + count)
        G[offset_rows, SIZE] = (SIZE_SD * size * self._scales[:, None] * self._offsets).ravel()
        G[offset_rows, PAINT : PAINT + count] = np.diag(self._paint_sd.ravel())
        ratios = np.array([digit.coupling for digit in self.table.digits]) + COUPLING_SD * x[-5:]
        G[-5:, -5:] = COUPLING_SD * np.eye(5)
        return HandGeometry(lengths, bases, metacarpals, rotations, offsets, ratios, G)

    def model(self, x: Array) -> HandModel:
        """The hand x as a model.

        Limits and what was not measured are the table's, at this hand's size.
        """
        geometry = self.geometry(x)
        size = float(np.exp(SIZE_SD * x[SIZE]))
        digits = tuple(
            msgspec.structs.replace(
                digit,
                lengths_m=_vector(geometry.lengths[row]),
                base_m=_vector(geometry.bases[row]),
                metacarpal_m=_vector(geometry.metacarpals[row]),
                base_wxyz=tuple(
                    np.round(quaternion_from_rotation(geometry.rotations[row]), 9).tolist()
                ),
                radii_m=_vector(size * np.array(digit.radii_m)),
                coupling=round(float(geometry.ratios[row]), 4),
            )
            for row, digit in enumerate(self.table.digits)
        )
        paint = {}
        for name, dab in self.table.paint.items():
            offset = (1.0 if name in TIPS else size) * np.array(dab.offset_m)
            if name in self.names:
                offset = geometry.offsets[self.names.index(name)]
            paint[name] = msgspec.structs.replace(
                dab, offset_m=_vector(offset), radius_m=round(size * dab.radius_m, 6)
            )
        radii = {
            name: round(size * getattr(self.table, name), 6)
            for name in ("wrist_radius_m", "palm_radius_m")
        }
        return msgspec.structs.replace(self.table, digits=digits, paint=paint, **radii)

    def _bone_lengths(self, x: Array, size: float, G: Array) -> Array:
        """Lengths (5, 3), log-normal about the table's; fills their rows of G."""
        sd = np.array(BONE_SD)
        lengths = self._lengths * size * np.exp(sd * x[BONES].reshape(5, 3))
        for row in range(5):
            for bone in range(3):
                if (row, bone) in self.known:
                    lengths[row, bone] = self.known[row, bone]
                else:
                    G[3 * row + bone, SIZE] = SIZE_SD * lengths[row, bone]
                    G[3 * row + bone, 1 + 3 * row + bone] = sd[row, bone] * lengths[row, bone]
        return lengths

    def _chain_base(self, row: int, x: Array, size: float, G: Array) -> Array:
        """A chain's base (3,): free along its metacarpal by the spread of people, across by less.

        Fills its rows of G.
        """
        own = x[triple(BASE_COLUMNS, row)]
        if row == 0:
            spread = THUMB_BASE_SD_M * np.eye(3)
            base = self._bases[0] + spread @ own
        else:
            along = self._bases[row] - self._metacarpals[row]
            length = float(np.linalg.norm(along))
            forward = along / length if length > 0.0 else np.array([0.0, 0.0, -1.0])
            side = np.cross(forward, [0.0, 1.0, 0.0])
            side /= np.linalg.norm(side)
            length *= float(np.exp(METACARPAL_SD[row] * own[0]))
            across = ACROSS_SD_M * np.stack([side, np.cross(side, forward)], axis=1)
            base = self._metacarpals[row] + length * forward + across @ own[1:]
            spread = np.column_stack([METACARPAL_SD[row] * length * forward, across])
        G[triple(BASE_ROWS, row), SIZE] = SIZE_SD * size * base
        G[triple(BASE_ROWS, row), triple(BASE_COLUMNS, row)] = size * spread
        return size * base

    def _chain_rotation(self, row: int, x: Array, G: Array) -> Array:
        """Rotation (3, 3) of a chain in the wrist frame; fills its rows of G."""
        rest = self._rotations[row]
        # Columns: axis of abduction, axis of the bone.
        axes = rest[:, 1:] * (THUMB_ROTATION_SD if row == 0 else ROTATION_SD)  # (3, 2)
        columns = slice(ROTATION_COLUMNS + 2 * row, ROTATION_COLUMNS + 2 * row + 2)
        rotation = axes @ x[columns]
        G[triple(ROTATION_ROWS, row), columns] = _left_jacobian(rotation) @ axes
        return rotation_from_vector(rotation) @ rest


def _joint_in_chain(name: str) -> tuple[int, int]:
    """As HandParameters.joint_of says."""
    joint = JOINT_INDEX[name]
    found = np.argwhere(joint == CHAIN_JOINTS)
    if len(found):
        return int(found[0][0]), int(found[0][1])
    if name in ("wrist", "palm"):
        return -1, int(name == "palm")
    return -2, DIGITS.index(name.removesuffix("_metacarpal"))


def _paint_sd_m(name: str) -> tuple[float, float, float]:
    if name == "wrist":
        return WRIST_PAINT_SD_M
    return TIP_PAINT_SD_M if name in TIPS else PAINT_SD_M


def _left_jacobian(rotation: Array) -> Array:
    """J with exp(rotation + J^-1 w) = exp(w) exp(rotation) to first order in w; (3,) -> (3, 3).

    Sola et al. 2018, eq. 145.
    """
    angle = float(np.linalg.norm(rotation))
    cross = skew(rotation)
    if angle < 1e-4:
        return np.eye(3) + 0.5 * cross + cross @ cross / 6.0
    return (
        np.eye(3)
        + (1.0 - np.cos(angle)) / angle**2 * cross
        + (angle - np.sin(angle)) / angle**3 * (cross @ cross)
    )


def _vector(values: Array) -> tuple:
    """Plain floats, to a micrometre."""
    return tuple(np.round(values, 6).tolist())
