"""Kinematics of one digit and of the whole hand: forward with every joint frame, and the geometric
Jacobian.

A digit is a chain of four hinges: abduction about y, then three flexions about -x, with bones along
-z. It is solved in its own *canonical frame*: origin in the chain's root, axes of the first bone at
zero angles, x mirrored for a left hand. So the maths knows neither the world (results cannot depend
on how the hand is turned) nor left from right. Numba kernels, each with a plain numpy twin
(`*_reference`) that tests compare it with. Input that is not finite gives output that is not
finite: callers check (services/solver/step.py).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array, rotation_from_quaternion, rotation_x, rotation_y
from rhot.hand import CHAIN_JOINTS, HandModel

# Joints of each digit from the chain's root to its tip, as a constant that kernels can use; (5, 4).
CHAINS = CHAIN_JOINTS.astype(np.int64)


class Chain(NamedTuple):
    """One digit in its canonical frame, as arrays for the kernels.

    Any unit of length (the solvers scale it to 1).
    """

    lengths: Array  # (3,) bones
    tool: Array  # (3,) the painted point in the axes of the last joint: about (0, 0, -length of the last bone)
    limits: Array  # (4, 2) rad
    coupling: Array  # (2,) ratio and weight of last flexion = ratio * second flexion


class Chains(NamedTuple):
    """The five chains of a hand as arrays for the kernels.

    Metres, radians, rows in the order of DIGITS.
    """

    base_m: Array  # (5, 3) root of each chain in the wrist frame
    base_rotation: Array  # (5, 3, 3) axes of its first bone at zero angles, in the wrist frame
    metacarpal_m: Array  # (5, 3) start of the metacarpal, in the wrist frame
    lengths_m: Array  # (5, 3) bones
    tool_m: Array  # (5, 3) the painted point in the canonical axes of the last joint: about (0, 0, -length of the last bone)
    limits_rad: Array  # (5, 4, 2)
    coupling: Array  # (5, 2) ratio and weight of last flexion = ratio * second flexion
    side: float  # +1 right hand, -1 left hand


def hand_chains(model: HandModel) -> Chains:
    """The kernels' view of a person's hand.

    The tool is the tip's painted point (Paint.offset_m short of the tip).
    """
    tool = np.empty((5, 3))
    for row, digit in enumerate(model.digits):
        x, y, z = model.paint[f"{digit.name}_tip"].offset_m
        tool[row] = (model.side * x, y, z - digit.lengths_m[2])
    return Chains(
        base_m=np.array([d.base_m for d in model.digits], dtype=np.float64),
        base_rotation=np.array([rotation_from_quaternion(d.base_wxyz) for d in model.digits]),
        metacarpal_m=np.array([d.metacarpal_m for d in model.digits], dtype=np.float64),
        lengths_m=np.array([d.lengths_m for d in model.digits], dtype=np.float64),
        tool_m=tool,
        limits_rad=np.array([d.limits_rad for d in model.digits], dtype=np.float64),
        coupling=np.array(
            [(d.coupling, d.coupling_weight) for d in model.digits], dtype=np.float64
        ),
        side=model.side,
    )


@njit(cache=True)
def chain_of(chains: Chains, row: int) -> Chain:
    """One digit of a hand, lengths in metres."""
    return Chain(
        chains.lengths_m[row], chains.tool_m[row], chains.limits_rad[row], chains.coupling[row]
    )


@njit(cache=True)
def reach_of(chain: Chain) -> float:
    """How far the painted point is from the root when every joint is straight, were the point on
    the bone's axis.
    """
    tool = chain.tool
    return (
        chain.lengths[0] + chain.lengths[1] + math.sqrt(tool[0] ** 2 + tool[1] ** 2 + tool[2] ** 2)
    )


@njit(cache=True)
def scaled(chain: Chain, factor: float) -> Chain:
    """The same digit in another unit of length."""
    return Chain(chain.lengths * factor, chain.tool * factor, chain.limits, chain.coupling)


@njit(cache=True)
def length_of(v: Array) -> float:
    """Euclidean length of (3,)."""
    return math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)


@njit(cache=True)
def distance_to(chain: Chain, q: Array, target: Array) -> float:
    """From the painted point at angles q (4,) to target (3,), canonical frame."""
    return length_of(tip(chain, q) - target)


@njit(cache=True)
def to_canonical(base_m: Array, base_rotation: Array, side: float, p_wrist: Array) -> Array:
    """A point of the wrist frame in a chain's canonical frame; (3,) -> (3,)."""
    dx, dy, dz = p_wrist[0] - base_m[0], p_wrist[1] - base_m[1], p_wrist[2] - base_m[2]
    out = np.empty(3)
    for i in range(3):
        out[i] = base_rotation[0, i] * dx + base_rotation[1, i] * dy + base_rotation[2, i] * dz
    out[0] *= side
    return out


@njit(cache=True)
def tip(chain: Chain, q: Array) -> Array:
    """The painted point in the canonical frame; q (4,) rad -> (3,)."""
    lengths, tool = chain.lengths, chain.tool
    a1, a2, a3 = q[1], q[1] + q[2], q[1] + q[2] + q[3]
    s3, c3 = math.sin(a3), math.cos(a3)
    y = -lengths[0] * math.sin(a1) - lengths[1] * math.sin(a2) + c3 * tool[1] + s3 * tool[2]
    z = -lengths[0] * math.cos(a1) - lengths[1] * math.cos(a2) - s3 * tool[1] + c3 * tool[2]
    s0, c0 = math.sin(q[0]), math.cos(q[0])
    out = np.empty(3)
    out[0], out[1], out[2] = c0 * tool[0] + s0 * z, y, c0 * z - s0 * tool[0]
    return out


@njit(cache=True)
def jacobian(chain: Chain, q: Array, p: Array, J: Array) -> None:
    """Fill p (3,) with the painted point and J (6, 4) with its geometric Jacobian, both in the
    canonical frame.

    Rows 0..2 are d p / d q, rows 3..5 the joint axes. Equal to the finger study's matrix A1
    (Chatterjee et al., appendix) with its D-H axes renamed, x_DH = -z, y_DH = x, z_DH = -y and
    theta_1 = -abduction; tests/services/solver/maths/test_kinematics.py.
    """
    lengths, tool = chain.lengths, chain.tool
    a1, a2, a3 = q[1], q[1] + q[2], q[1] + q[2] + q[3]
    s0, c0, s3, c3 = math.sin(q[0]), math.cos(q[0]), math.sin(a3), math.cos(a3)
    y1, z1 = -lengths[0] * math.sin(a1), -lengths[0] * math.cos(a1)
    y2, z2 = y1 - lengths[1] * math.sin(a2), z1 - lengths[1] * math.cos(a2)
    y, z = y2 + c3 * tool[1] + s3 * tool[2], z2 - s3 * tool[1] + c3 * tool[2]
    p[0], p[1], p[2] = c0 * tool[0] + s0 * z, y, c0 * z - s0 * tool[0]
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


@njit(cache=True)
def tip_rotation(q: Array) -> Array:
    """Axes of the last bone in the canonical frame: R_y(abduction) R_x(-sum of flexions).

    (4,) -> (3, 3).
    """
    s0, c0 = math.sin(q[0]), math.cos(q[0])
    s, c = math.sin(q[1] + q[2] + q[3]), math.cos(q[1] + q[2] + q[3])
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = c0, -s0 * s, s0 * c
    R[1, 0], R[1, 1], R[1, 2] = 0.0, c, s
    R[2, 0], R[2, 1], R[2, 2] = -s0, -c0 * s, c0 * c
    return R


@njit(cache=True)
def hand_frames(
    chains: Chains,
    wrist_rotation: Array,
    wrist_m: Array,
    angles: Array,
    positions: Array,
    rotations: Array,
) -> None:
    """Fill positions (26, 3) and rotations (26, 3, 3) of all joints as rhot.hand.forward does.

    Angles (5, 4) rad.
    """
    for j in range(26):
        positions[j] = wrist_m
        rotations[j] = wrist_rotation
    bone = np.empty((3, 3))
    turn = np.zeros((3, 3))
    for row in range(5):
        root = CHAINS[row, 0]
        if row > 0:
            positions[root - 1] = wrist_m + wrist_rotation @ chains.metacarpal_m[row]
        s, c = math.sin(chains.side * angles[row, 0]), math.cos(chains.side * angles[row, 0])
        turn[:] = 0.0
        turn[0, 0], turn[0, 2], turn[1, 1], turn[2, 0], turn[2, 2] = c, s, 1.0, -s, c
        bone[:] = wrist_rotation @ chains.base_rotation[row] @ turn
        positions[root] = wrist_m + wrist_rotation @ chains.base_m[row]
        for k in range(3):
            s, c = math.sin(angles[row, k + 1]), math.cos(angles[row, k + 1])
            for i in range(3):
                y, z = bone[i, 1], bone[i, 2]
                bone[i, 1], bone[i, 2] = c * y - s * z, s * y + c * z
            joint = CHAINS[row, k]
            rotations[joint] = bone
            positions[CHAINS[row, k + 1]] = positions[joint] - chains.lengths_m[row, k] * bone[:, 2]
        rotations[CHAINS[row, 3]] = bone
    middle = CHAINS[2, 0]
    positions[0] = 0.5 * (positions[middle - 1] + positions[middle])


def tip_reference(chain: Chain, q: Array) -> tuple[Array, Array]:
    """`tip` and `tip_rotation` as a product of rotations, in plain numpy: point (3,), axes (3, 3)."""
    R, p = rotation_y(q[0]), np.zeros(3)
    for flexion, length in zip(q[1:], (*chain.lengths[:2], 0.0), strict=True):
        R = R @ rotation_x(-flexion)
        p = p - length * R[:, 2]
    return p + R @ chain.tool, R


def jacobian_reference(chain: Chain, q: Array) -> Array:
    """The geometric Jacobian from axes and lever arms (axis x arm), in plain numpy; (6, 4)."""
    R, p = rotation_y(q[0]), np.zeros(3)
    point, _ = tip_reference(chain, q)
    axes, roots = [np.array([0.0, 1.0, 0.0])], [np.zeros(3)]
    for flexion, length in zip(q[1:], (*chain.lengths[:2], 0.0), strict=True):
        axes.append(-R[:, 0])
        roots.append(p)
        R = R @ rotation_x(-flexion)
        p = p - length * R[:, 2]
    linear = [np.cross(axis, point - root) for axis, root in zip(axes, roots, strict=True)]
    return np.vstack([np.array(linear).T, np.array(axes).T])
