"""A solved hand as a HandPose message: 26 joints in OpenXR order, angles by name, where each value
comes from and how sure it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, JOINTS
from rhot.messages import (
    FingerAngles,
    FingerPose,
    HandJoint,
    HandPoints,
    HandPose,
    JointSource,
    WristPose,
)
from services.solver.finger.solve_fingers import Fingers
from services.solver.maths.kinematics import CHAINS

# Micrometres and microradians: a thousandth of what the markers are good for.
_DIGITS = 6

# Of each joint: the digit whose chain it belongs to, -1 for those fixed to the wrist.
_DIGIT_OF = [next((row for row in range(5) if joint in CHAINS[row, 1:]), -1) for joint in range(26)]


@njit(cache=True)
def quaternions(rotations: Array) -> Array:
    """Unit quaternions wxyz with w >= 0 (Shepperd) of rotations (n, 3, 3); (n, 4)."""
    out = np.empty((rotations.shape[0], 4))
    for n in range(rotations.shape[0]):
        r = rotations[n]
        trace = r[0, 0] + r[1, 1] + r[2, 2]
        if trace >= r[0, 0] and trace >= r[1, 1] and trace >= r[2, 2]:
            w, x, y, z = 1.0 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
        elif r[0, 0] >= r[1, 1] and r[0, 0] >= r[2, 2]:
            w, x, y, z = (
                r[2, 1] - r[1, 2],
                1.0 - trace + 2.0 * r[0, 0],
                r[0, 1] + r[1, 0],
                r[0, 2] + r[2, 0],
            )
        elif r[1, 1] >= r[2, 2]:
            w, x, y, z = (
                r[0, 2] - r[2, 0],
                r[0, 1] + r[1, 0],
                1.0 - trace + 2.0 * r[1, 1],
                r[1, 2] + r[2, 1],
            )
        else:
            w, x, y, z = (
                r[1, 0] - r[0, 1],
                r[0, 2] + r[2, 0],
                r[1, 2] + r[2, 1],
                1.0 - trace + 2.0 * r[2, 2],
            )
        size = math.sqrt(w * w + x * x + y * y + z * z)
        if w < 0.0:
            size = -size
        out[n, 0], out[n, 1], out[n, 2], out[n, 3] = w / size, x / size, y / size, z / size
    return out


def rounded(values: Array) -> list:
    """Nested lists of floats rounded for the wire, without negative zeros."""
    return (np.round(values, _DIGITS) + 0.0).tolist()


def rounded_inside(angles: Array, limits: Array) -> Array:
    """Angles (5, 4) as they go out: rounded, and still within limits (5, 4, 2) where rounding would
    cross one.
    """
    inside = np.clip(np.round(angles, _DIGITS), limits[:, :, 0], limits[:, :, 1])
    return inside + 0.0


def sources(measured: set[str], located: bool, digit_solved: list[bool]) -> list[JointSource]:
    """Of each joint: measured (its landmark was seen), solved (markers fix it) or predicted (only
    the past and habit do).
    """
    result: list[JointSource] = []
    for joint, name in enumerate(JOINTS):
        row = _DIGIT_OF[joint]
        if name in measured:
            result.append("measured")
        else:
            result.append("solved" if located and (row < 0 or digit_solved[row]) else "predicted")
    return result


@dataclass(frozen=True)
class Skeleton:
    """The 26 joints: positions (26, 3) m and rotations (26, 3, 3) in the rig frame, skin radii in
    m, where each comes from.
    """

    positions_m: Array
    rotations: Array
    radii_m: list[float]
    sources: list[JointSource]


@dataclass(frozen=True)
class Spread:
    """One standard deviation: of the wrist's place (m) and turn (rad) as lengths of vectors, of
    each digit's angles (rad).
    """

    wrist_m: float
    wrist_rad: float
    fingers_rad: list[float]


def spread_of(covariance: Array, limits: Array) -> Spread:
    """From the covariance (26, 26) of a pose; limits (5, 4, 2) tell which angles can move.

    Half a turn and a metre say: unknown.
    """
    variance = np.maximum(np.diag(covariance), 0.0)
    free = limits[:, :, 1] > limits[:, :, 0]
    angles = np.where(free, variance[6:].reshape(5, 4), 0.0).sum(axis=1) / np.maximum(
        free.sum(axis=1), 1
    )
    wrist_rad, wrist_m = math.sqrt(variance[:3].sum()), math.sqrt(variance[3:6].sum())
    return Spread(
        min(wrist_m, 1.0), min(wrist_rad, math.pi), np.minimum(np.sqrt(angles), math.pi).tolist()
    )


def hand_pose(
    points: HandPoints, method: str, skeleton: Skeleton, fingers: Fingers, spread: Spread
) -> HandPose:
    """The message; fingers are already rounded and within limits."""
    where, how = rounded(skeleton.positions_m), rounded(quaternions(skeleton.rotations))
    joints = [
        HandJoint(
            name=name,
            position_m=tuple(p),
            orientation_wxyz=tuple(o),
            radius_m=radius,
            source=source,
        )
        for name, p, o, radius, source in zip(
            JOINTS, where, how, skeleton.radii_m, skeleton.sources, strict=True
        )
    ]
    wrist = JOINTS.index("wrist")
    return HandPose(
        hand=points.hand,
        seq=points.seq,
        stamp_ns=points.stamp_ns,
        method=method,
        wrist=WristPose(position_m=tuple(where[wrist]), orientation_wxyz=tuple(how[wrist])),
        joints=joints,
        fingers=[
            _finger(row, name, fingers, spread.fingers_rad[row]) for row, name in enumerate(DIGITS)
        ],
        wrist_sigma_m=round(spread.wrist_m, _DIGITS),
        wrist_sigma_rad=round(spread.wrist_rad, _DIGITS),
    )


def _finger(row: int, name: str, fingers: Fingers, sigma_rad: float) -> FingerPose:
    abduction, first, second, last = fingers.angles_rad[row].tolist()
    if name == "thumb":
        angles = FingerAngles(abduction=abduction, cmc=first, mcp=second, pip=0.0, dip=last)
    else:
        angles = FingerAngles(abduction=abduction, mcp=first, pip=second, dip=last)
    return FingerPose(
        name=name,  # type: ignore[arg-type]
        angles_rad=angles,
        residual_m=round(fingers.residual_m[row], _DIGITS),
        iterations=fingers.iterations[row],
        status=fingers.status[row],
        sigma_rad=round(sigma_rad, _DIGITS),
    )
