"""Forward kinematics of a hand as a compiled kernel, for every frame of every camera.

rhot.hand.forward, about 40 times as fast (3 us). Services do not import each other, so the
simulator keeps a kernel of its own beside services/solver/maths/kinematics.py; a test proves that
it agrees with rhot.hand.forward to 1e-12. Angles and poses must be finite.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import CHAIN_JOINTS, HandModel

_CHAIN = CHAIN_JOINTS.astype(np.int64)


class Bones(NamedTuple):
    """One hand as arrays, rows in the order of DIGITS; metres, wrist frame."""

    side: float  # +1 right hand, -1 left hand
    base_m: Array  # (5, 3) root of each chain
    base_rotation: Array  # (5, 3, 3) axes of its first bone at zero angles
    metacarpal_m: Array  # (5, 3)
    lengths_m: Array  # (5, 3)


class Skeleton:
    """One hand's bones, and where its joints are."""

    def __init__(self, model: HandModel) -> None:
        self._bones = Bones(
            side=model.side,
            base_m=np.array([digit.base_m for digit in model.digits]),
            base_rotation=np.array(
                [rotation_from_quaternion(digit.base_wxyz) for digit in model.digits]
            ),
            metacarpal_m=np.array([digit.metacarpal_m for digit in model.digits]),
            lengths_m=model.lengths_m,
        )

    def joints(
        self, wrist_rotation: Array, wrist_m: Array, angles_rad: Array
    ) -> tuple[Array, Array]:
        """Positions (26, 3) and rotations (26, 3, 3), as rhot.hand.forward."""
        positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
        _forward(
            self._bones,
            np.ascontiguousarray(wrist_rotation),
            np.ascontiguousarray(wrist_m),
            np.ascontiguousarray(angles_rad),
            positions,
            rotations,
        )
        return positions, rotations


@njit(cache=True, nogil=True)
def _forward(
    bones: Bones,
    wrist_rotation: Array,
    wrist_m: Array,
    angles_rad: Array,
    positions: Array,
    rotations: Array,
) -> None:
    """Fill positions (26, 3) and rotations (26, 3, 3)."""
    position = np.empty(3)
    rotation = np.empty((3, 3))
    positions[:2] = wrist_m
    rotations[:] = wrist_rotation
    for row in range(5):
        first = _CHAIN[row, 0]
        if row > 0:
            _place(wrist_rotation, wrist_m, bones.metacarpal_m[row], positions[first - 1])
        _multiply(wrist_rotation, bones.base_rotation[row], rotation)
        # Summed in another order than in _place: it rounds otherwise, and simulated recordings are
        # to stay the same to the last bit.
        base = bones.base_m[row]
        for i in range(3):
            position[i] = (
                wrist_m[i]
                + wrist_rotation[i, 0] * base[0]
                + wrist_rotation[i, 1] * base[1]
                + wrist_rotation[i, 2] * base[2]
            )
        for bone in range(3):
            joint = _CHAIN[row, bone]
            about_y = bones.side * angles_rad[row, 0] if bone == 0 else 0.0
            _turn(rotation, about_y, angles_rad[row, bone + 1], rotations[joint])
            rotation[:] = rotations[joint]
            positions[joint] = position
            for i in range(3):
                position[i] -= bones.lengths_m[row, bone] * rotation[i, 2]
        tip = _CHAIN[row, 3]
        positions[tip] = position
        rotations[tip] = rotation
    middle = _CHAIN[2, 0]
    for i in range(3):
        positions[0, i] = 0.5 * (positions[middle - 1, i] + positions[middle, i])


@njit(cache=True, nogil=True)
def _place(rotation: Array, origin: Array, p: Array, out: Array) -> None:
    """out (3,) = origin + rotation @ p."""
    for i in range(3):
        out[i] = origin[i] + (rotation[i, 0] * p[0] + rotation[i, 1] * p[1] + rotation[i, 2] * p[2])


@njit(cache=True, nogil=True)
def _multiply(a: Array, b: Array, out: Array) -> None:
    """out (3, 3) = a @ b."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@njit(cache=True, nogil=True)
def _turn(rotation: Array, about_y: float, flexion: float, out: Array) -> None:
    """out (3, 3) = rotation @ Ry(about_y) @ Rx(-flexion)."""
    cy, sy, cx, sx = np.cos(about_y), np.sin(about_y), np.cos(flexion), np.sin(flexion)
    for i in range(3):
        x = cy * rotation[i, 0] - sy * rotation[i, 2]
        z = sy * rotation[i, 0] + cy * rotation[i, 2]
        y = rotation[i, 1]
        out[i, 0], out[i, 1], out[i, 2] = x, cx * y - sx * z, sx * y + cx * z
