"""The compiled kinematics of a hand: joint frames, painted tips and geometric Jacobians.

Forward kinematics of the whole hand (`hand_frames`), of its digits in the wrist frame with their
joint axes (`digit_frames`), and of one painted tip in its digit's canonical frame
(services/solver/maths/ chains.py) with its Jacobian. rhot.hand is the plain Python for the same;
the kernels repeat it for speed, each in the form its caller needs, and
tests/services/solver/maths/test_kinematics.py proves that they agree. Input that is not finite
gives output that is not finite: callers check (services/solver/step.py).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import unowned
from services.solver.maths.chains import CHAINS, Chain, HandChains, norm
from services.solver.maths.rotation_vectors import turned

# For the kernels of many short sums: products may be fused with sums, and these added up in any
# order. Not a number and infinite stay what they are.
FUSED = {"contract", "reassoc"}


@njit(cache=True)
def tip_position(chain: Chain, q: Array) -> Array:
    """The painted point in the canonical frame; q (4,) rad -> (3,)."""
    lengths, tool = chain.lengths, chain.tool
    a1, a2, a3 = q[1], q[1] + q[2], q[1] + q[2] + q[3]  # absolute flexion of each bone
    s3, c3 = math.sin(a3), math.cos(a3)
    y = -lengths[0] * math.sin(a1) - lengths[1] * math.sin(a2) + c3 * tool[1] + s3 * tool[2]
    z = -lengths[0] * math.cos(a1) - lengths[1] * math.cos(a2) - s3 * tool[1] + c3 * tool[2]
    s0, c0 = math.sin(q[0]), math.cos(q[0])
    p = np.empty(3)
    p[0] = c0 * tool[0] + s0 * z
    p[1] = y
    p[2] = c0 * z - s0 * tool[0]
    return p


@njit(cache=True)
def tip_rotation(q: Array) -> Array:
    """Axes of the last bone in the canonical frame, R_y(abduction) R_x(-sum of flexions).

    (4,) rad -> (3, 3).
    """
    s0, c0 = math.sin(q[0]), math.cos(q[0])
    s, c = math.sin(q[1] + q[2] + q[3]), math.cos(q[1] + q[2] + q[3])
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = c0, -s0 * s, s0 * c
    R[1, 0], R[1, 1], R[1, 2] = 0.0, c, s
    R[2, 0], R[2, 1], R[2, 2] = -s0, -c0 * s, c0 * c
    return R


@njit(cache=True)
def tip_distance(chain: Chain, q: Array, target: Array) -> float:
    """Distance from the painted point at angles q (4,) to target (3,), canonical frame."""
    return norm(tip_position(chain, q) - target)


@njit(cache=True)
def tip_jacobian(chain: Chain, q: Array, p: Array, J: Array) -> None:
    """Fill p (3,) with the painted point and J (6, 4) with its geometric Jacobian.

    Both in the canonical frame. Rows 0..2 are d p / d q, rows 3..5 the joint axes. Equal to the
    finger study's matrix A1 (Chatterjee et al., appendix) with its D-H axes renamed, x_DH = -z,
    y_DH = x, z_DH = -y and theta_1 = -abduction; tests/services/solver/maths/test_kinematics.py.
    """
    lengths, tool = chain.lengths, chain.tool
    a1, a2, a3 = q[1], q[1] + q[2], q[1] + q[2] + q[3]  # absolute flexion of each bone
    s0, c0 = math.sin(q[0]), math.cos(q[0])
    s3, c3 = math.sin(a3), math.cos(a3)
    # Joints and painted point in the plane of bending: (y, z) at zero abduction.
    y1, z1 = -lengths[0] * math.sin(a1), -lengths[0] * math.cos(a1)
    y2, z2 = y1 - lengths[1] * math.sin(a2), z1 - lengths[1] * math.cos(a2)
    y, z = y2 + c3 * tool[1] + s3 * tool[2], z2 - s3 * tool[1] + c3 * tool[2]
    p[0] = c0 * tool[0] + s0 * z
    p[1] = y
    p[2] = c0 * z - s0 * tool[0]
    J[0, 0], J[1, 0], J[2, 0] = p[2], 0.0, -p[0]
    J[3, 0], J[4, 0], J[5, 0] = 0.0, 1.0, 0.0
    for j in range(1, 4):
        if j == 1:
            ry, rz = y, z
        elif j == 2:
            ry, rz = y - y1, z - z1
        else:
            ry, rz = y - y2, z - z2
        J[0, j], J[1, j], J[2, j] = -s0 * ry, rz, -c0 * ry
        J[3, j], J[4, j], J[5, j] = -c0, 0.0, s0


class DigitFrames(NamedTuple):
    """All digits in the wrist frame, as the Jacobian of a landmark needs them."""

    roots_m: Array  # (5, 4, 3) joint positions, root to tip
    axes: Array  # (5, 4, 3) unit axes of the four angles
    rotations: Array  # (5, 4, 3, 3) of the joints; that of the tip is its last bone's


@njit(cache=True, fastmath=FUSED)
def digit_frames(chains: HandChains, angles: Array) -> DigitFrames:
    """Forward kinematics of all digits in the wrist frame; angles (5, 4) rad."""
    frames = DigitFrames(np.empty((5, 4, 3)), np.empty((5, 4, 3)), np.empty((5, 4, 3, 3)))
    _fill_digits(chains, angles, frames)
    return frames


@njit(cache=True, fastmath=FUSED)
def _fill_digits(chains: HandChains, angles: Array, frames: DigitFrames) -> None:
    chains, angles, frames = unowned((chains, angles, frames))
    for row in range(5):
        _fill_digit(
            chains, row, angles[row], frames.roots_m[row], frames.axes[row], frames.rotations[row]
        )


@njit(cache=True, fastmath=FUSED)
def _fill_digit(
    chains: HandChains, row: int, q: Array, roots: Array, axes: Array, rotations: Array
) -> None:
    """One digit of DigitFrames; q (4,).

    The three flexions turn about the same axis, so that each bone's turn is that of their sum.
    """
    B, side = chains.base_rotation[row], chains.side
    s0, c0 = math.sin(side * q[0]), math.cos(side * q[0])
    s1, c1 = math.sin(q[1]), math.cos(q[1])
    s2, c2 = math.sin(q[1] + q[2]), math.cos(q[1] + q[2])
    s3, c3 = math.sin(q[1] + q[2] + q[3]), math.cos(q[1] + q[2] + q[3])
    for i in range(3):
        # Axes of the first bone at zero flexion.
        x, y, z = c0 * B[i, 0] - s0 * B[i, 2], B[i, 1], s0 * B[i, 0] + c0 * B[i, 2]
        axes[0, i], axes[1, i], axes[2, i], axes[3, i] = side * y, -x, -x, -x
        for k in range(4):
            rotations[k, i, 0] = x
        rotations[0, i, 1], rotations[0, i, 2] = c1 * y - s1 * z, s1 * y + c1 * z
        rotations[1, i, 1], rotations[1, i, 2] = c2 * y - s2 * z, s2 * y + c2 * z
        for k in range(2, 4):
            rotations[k, i, 1], rotations[k, i, 2] = c3 * y - s3 * z, s3 * y + c3 * z
        roots[0, i] = chains.base_m[row, i]
        for k in range(3):
            roots[k + 1, i] = roots[k, i] - chains.lengths_m[row, k] * rotations[k, i, 2]


@njit(cache=True, fastmath=FUSED)
def hand_frames(
    chains: HandChains,
    wrist_rotation: Array,
    wrist_m: Array,
    angles: Array,
    positions: Array,
    rotations: Array,
) -> None:
    """Fill positions (26, 3) and rotations (26, 3, 3) of all joints as rhot.hand.forward does.

    Angles (5, 4) rad.
    """
    frames = digit_frames(chains, angles)
    _fill_joints(chains, wrist_rotation, wrist_m, frames, positions, rotations)


@njit(cache=True, fastmath=FUSED)
def _fill_joints(
    chains: HandChains,
    wrist_rotation: Array,
    wrist_m: Array,
    frames: DigitFrames,
    positions: Array,
    rotations: Array,
) -> None:
    """hand_frames, from those of its digits."""
    chains, R, wrist_m = unowned((chains, wrist_rotation, wrist_m))
    frames, positions, rotations = unowned((frames, positions, rotations))
    for joint in range(26):
        for i in range(3):
            positions[joint, i] = wrist_m[i]
            for k in range(3):
                rotations[joint, i, k] = R[i, k]
    for row in range(5):
        root = CHAINS[row, 0]
        if row > 0:
            m = chains.metacarpal_m
            x, y, z = turned(R, m[row, 0], m[row, 1], m[row, 2])
            _shift(positions[root - 1], x, y, z)
        for k in range(4):
            joint, r, F = CHAINS[row, k], frames.roots_m[row, k], frames.rotations[row, k]
            x, y, z = turned(R, r[0], r[1], r[2])
            _shift(positions[joint], x, y, z)
            for i in range(3):
                x, y, z = turned(R, F[0, i], F[1, i], F[2, i])
                rotations[joint, 0, i], rotations[joint, 1, i], rotations[joint, 2, i] = x, y, z
    middle = CHAINS[2, 0]
    for i in range(3):
        positions[0, i] = 0.5 * (positions[middle - 1, i] + positions[middle, i])


@njit(cache=True, inline="always")
def _shift(place: Array, x: float, y: float, z: float) -> None:
    """Move a place (3,) by a vector."""
    place[0] += x
    place[1] += y
    place[2] += z
