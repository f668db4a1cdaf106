"""The whole hand from its markers: wrist pose (6 unknowns) and all angles (20) in one
box-constrained least-squares problem.

Wrist and five tips measure 18 numbers; under RHOT's constraints the hand has 21 degrees of freedom,
so the soft constraints of constraints.py and the previous pose say the rest, each weighed by its
standard deviation against the markers'. Levenberg- Marquardt with Marquardt's scaling; steps stay
within the joint limits (box_qp); Huber weights keep one wrong marker from bending the hand. A
missing marker is simply no equation: its finger then follows the priors and the previous pose.
Input that is not finite must not come here (services/solver/step.py drops it).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import JOINTS, HandModel
from services.solver.maths.box_qp import Integers, box_qp
from services.solver.maths.kinematics import CHAINS, Chains
from services.solver.maths.rotation_vectors import rotation_vector, turned
from services.solver.whole_hand.motion_prior import UNKNOWNS, Belief

# Whitened distance beyond which a marker counts linearly: a millimetre-accurate marker that is 5 mm
# off is no longer noise but may still be a bone measured short.
_HUBER = 5.0
# Marquardt's factor: start, and how it moves; the usual values (Madsen, Nielsen & Tingleff 2004,
# section 3.2) made bolder, as the previous pose is nearly always a good start.
_DAMPING_START, _DAMPING_DOWN, _DAMPING_UP = 1e-5, 0.1, 8.0


class Marks(NamedTuple):
    """Markers as arrays: which joint frame each is fixed to, where in it, where it was seen (rig
    frame) and how well.
    """

    joint: Integers  # (m,) index into JOINTS
    digit: Integers  # (m,) row of its chain, -1: fixed to the wrist frame
    depth: Integers  # (m,) how many of the chain's four angles move it
    offset_m: Array  # (m, 3) in the joint's frame; in the wrist frame where digit is -1
    point_m: Array  # (m, 3) rig frame
    inverse_sigma: Array  # (m, 3) 1/m along each rig axis


def place_of(model: HandModel, name: str) -> tuple[int, int, int, Array]:
    """joint, digit, depth and offset of a landmark for Marks."""
    joint = JOINTS.index(name)
    offset = np.array(model.paint[name].offset_m)
    found = np.argwhere(joint == CHAINS)
    if len(found):
        row, k = (int(v) for v in found[0])
        return joint, row, min(k + 2, 4), offset
    digits = {digit.name: np.array(digit.metacarpal_m) for digit in model.digits}
    if name == "palm":
        offset = offset + 0.5 * (digits["middle"] + np.array(model.digits[2].base_m))
    elif name != "wrist":
        offset = offset + digits[name.removesuffix("_metacarpal")]  # type: ignore[index]
    return joint, -1, 0, offset


@njit(cache=True)
def _digit_frames(
    chains: Chains, row: int, q: Array, roots: Array, axes: Array, frames: Array
) -> None:
    """Of one digit, in the wrist frame: joint positions roots (4, 3), axes (4, 3) of the four
    angles, frames (4, 3, 3).
    """
    s, c = math.sin(chains.side * q[0]), math.cos(chains.side * q[0])
    B = chains.base_rotation[row]
    F = np.empty((3, 3))
    for i in range(3):
        axes[0, i] = chains.side * B[i, 1]
        F[i, 0], F[i, 1], F[i, 2] = c * B[i, 0] - s * B[i, 2], B[i, 1], s * B[i, 0] + c * B[i, 2]
        roots[0, i] = chains.base_m[row, i]
    for k in range(3):
        s, c = math.sin(q[k + 1]), math.cos(q[k + 1])
        for i in range(3):
            axes[k + 1, i] = -F[i, 0]
            y, z = F[i, 1], F[i, 2]
            F[i, 1], F[i, 2] = c * y - s * z, s * y + c * z
            roots[k + 1, i] = roots[k, i] - chains.lengths_m[row, k] * F[i, 2]
        frames[k] = F
    frames[3] = F


@njit(cache=True)
def _add_mark(
    R: Array,
    t: Array,
    p: Array,
    J: Array,
    columns: Integers,
    count: int,
    mark: int,
    marks: Marks,
    H: Array,
    g: Array,
) -> float:
    """Add one marker's normal equations: p (3,) and J (3, count) in the wrist frame.

    Returns its Huber cost.
    """
    arm = R @ p
    full = np.zeros((3, 10))
    full[0, 1], full[0, 2] = arm[2], -arm[1]
    full[1, 0], full[1, 2] = -arm[2], arm[0]
    full[2, 0], full[2, 1] = arm[1], -arm[0]
    for i in range(3):
        full[i, 3 + i] = 1.0
        for a in range(count):
            full[i, 6 + a] = R[i, 0] * J[0, a] + R[i, 1] * J[1, a] + R[i, 2] * J[2, a]
    e = np.empty(3)
    square = 0.0
    for i in range(3):
        e[i] = (arm[i] + t[i] - marks.point_m[mark, i]) * marks.inverse_sigma[mark, i]
        square += e[i] * e[i]
    distance = math.sqrt(square)
    weight = 1.0 if distance <= _HUBER else _HUBER / distance
    for i in range(3):
        w = weight * marks.inverse_sigma[mark, i]
        for a in range(6 + count):
            ga = w * full[i, a]
            g[columns[a]] += ga * e[i]
            ga *= marks.inverse_sigma[mark, i]
            for b in range(a + 1):
                H[columns[a], columns[b]] += ga * full[i, b]
    return square if distance <= _HUBER else _HUBER * (2.0 * distance - _HUBER)


@njit(cache=True)
def _normal_equations(chains: Chains, marks: Marks, belief: Belief, R: Array, t: Array, q: Array, H: Array, g: Array) -> float:  # fmt: skip
    """Fill H (26, 26) and g (26,) of the whole problem at a pose.

    Returns the cost (sum of squares in standard deviations).
    """
    H[:] = 0.0
    g[:] = 0.0
    cost = 0.0
    roots, axes, frames = np.empty((5, 4, 3)), np.empty((5, 4, 3)), np.empty((5, 4, 3, 3))
    for row in range(5):
        _digit_frames(chains, row, q[row], roots[row], axes[row], frames[row])
    columns = np.arange(10, dtype=np.int64)
    p, J = np.empty(3), np.empty((3, 4))
    for mark in range(marks.joint.size):
        row, depth = marks.digit[mark], marks.depth[mark]
        if row < 0:
            p[:] = marks.offset_m[mark]
        else:
            k = 0
            while CHAINS[row, k] != marks.joint[mark]:
                k += 1
            o, F = marks.offset_m[mark], frames[row, k]
            for i in range(3):
                p[i] = roots[row, k, i] + F[i, 0] * o[0] + F[i, 1] * o[1] + F[i, 2] * o[2]
            for a in range(depth):
                columns[6 + a] = 6 + 4 * row + a
                x, y, z = axes[row, a]
                origin = roots[row, max(a - 1, 0)]
                u, v, w = p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]
                J[0, a], J[1, a], J[2, a] = y * w - z * v, z * u - x * w, x * v - y * u
        cost += _add_mark(R, t, p, J, columns, depth, mark, marks, H, g)
    for a in range(UNKNOWNS):
        for b in range(a):
            H[b, a] = H[a, b]
    off = np.empty(UNKNOWNS)
    off[:3] = rotation_vector(R @ belief.rotation.T)
    off[3:6] = t - belief.position_m
    off[6:] = (q - belief.angles).ravel()
    pull = belief.information @ off
    H += belief.information
    g += pull
    return cost + float(off @ pull)


@njit(cache=True)
def fit(
    chains: Chains,
    marks: Marks,
    belief: Belief,
    R: Array,
    t: Array,
    q: Array,
    most: int,
    information: Array,
) -> tuple[float, int]:
    """Improve the pose R (3, 3), t (3,), q (5, 4) in place; returns (cost, iterations). Angles stay
    within their limits.

    information (26, 26) is filled with that of the pose found: its inverse is the covariance.
    """
    H, g, D = np.empty((UNKNOWNS, UNKNOWNS)), np.empty(UNKNOWNS), np.empty((UNKNOWNS, UNKNOWNS))
    low, high, step = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf), np.empty(UNKNOWNS)
    new_q = np.empty((5, 4))
    room, lists = np.empty((UNKNOWNS + 1, UNKNOWNS)), np.empty((2, UNKNOWNS), np.int64)
    new_H, new_g = np.empty((UNKNOWNS, UNKNOWNS)), np.empty(UNKNOWNS)
    cost = _normal_equations(chains, marks, belief, R, t, q, H, g)
    damping = _DAMPING_START
    used = 0
    while used < most:
        used += 1
        D[:] = H
        for a in range(UNKNOWNS):
            # The floor keeps a direction that nothing measures definite.
            D[a, a] += damping * H[a, a] + 1e-9
        for a in range(20):
            low[6 + a] = chains.limits_rad[a // 4, a % 4, 0] - q[a // 4, a % 4]
            high[6 + a] = chains.limits_rad[a // 4, a % 4, 1] - q[a // 4, a % 4]
        if not box_qp(D, g, low, high, step, room, lists):
            break
        new_R, new_t = turned(R, step[:3]), t + step[3:6]
        for a in range(20):
            limit = chains.limits_rad[a // 4, a % 4]
            new_q[a // 4, a % 4] = min(max(q[a // 4, a % 4] + step[6 + a], limit[0]), limit[1])
        new_cost = _normal_equations(chains, marks, belief, new_R, new_t, new_q, new_H, new_g)
        if new_cost <= cost:
            # A thousandth of a standard deviation squared is far below what the pose is good for.
            done = cost - new_cost < 1e-3 * (1.0 + 1e-3 * cost)
            R[:], t[:], q[:], cost = new_R, new_t, new_q, new_cost
            H, new_H, g, new_g = new_H, H, new_g, g
            damping = max(damping * _DAMPING_DOWN, 1e-9)
            if done:
                break
        else:
            damping *= _DAMPING_UP
            if damping > 1e6:
                break
    information[:] = H
    return cost, used
