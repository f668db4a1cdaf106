"""A solved hand as a HandPose message.

26 joints in OpenXR order, angles by name, where each value comes from and how sure it is.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, JOINT_INDEX, JOINTS
from rhot.messages import (
    FingerAngles,
    FingerPose,
    HandJoint,
    HandPoints,
    HandPose,
    JointSource,
    WristPose,
)
from services.solver.finger.solve_fingers import FingerSolution
from services.solver.maths.chains import CHAINS
from services.solver.maths.quaternions import quaternions_from_rotations

# Micrometres and microradians: a thousandth of what the landmarks are good for.
_DECIMALS = 6
_UNITS = 10.0**_DECIMALS

# Of each joint: the digit whose chain it belongs to, -1 for those fixed to the wrist.
_DIGIT_OF = [next((row for row in range(5) if joint in CHAINS[row, 1:]), -1) for joint in range(26)]


@dataclass(frozen=True)
class Skeleton:
    """The 26 joints, in the order of JOINTS."""

    positions_m: Array  # (26, 3) rig frame
    rotations: Array  # (26, 3, 3) rig frame
    radii_m: list[float]  # of the skin
    sources: list[JointSource]


@dataclass(frozen=True)
class PoseUncertainty:
    """One standard deviation of each part of the pose."""

    wrist_m: float  # length of the position's error
    wrist_rad: float  # length of the rotation vector's error
    fingers_rad: list[float]  # (5,) of each digit's angles


def hand_pose(
    points: HandPoints,
    method: str,
    skeleton: Skeleton,
    fingers: FingerSolution,
    uncertainty: PoseUncertainty,
) -> HandPose:
    """The message; fingers are already rounded and within limits."""
    numbers = _rounded_frames(skeleton.positions_m, skeleton.rotations).tolist()
    parts = zip(JOINTS, numbers, skeleton.radii_m, skeleton.sources, strict=True)
    joints = [
        HandJoint(
            name=name,
            position_m=(px, py, pz),
            orientation_wxyz=(w, x, y, z),
            radius_m=radius_m,
            source=source,
        )
        for name, (px, py, pz, w, x, y, z), radius_m, source in parts
    ]
    wrist = joints[JOINT_INDEX["wrist"]]
    return HandPose(
        hand=points.hand,
        seq=points.seq,
        stamp_ns=points.stamp_ns,
        method=method,
        wrist=WristPose(position_m=wrist.position_m, orientation_wxyz=wrist.orientation_wxyz),
        joints=joints,
        fingers=[
            _finger_pose(row, name, fingers, uncertainty.fingers_rad[row])
            for row, name in enumerate(DIGITS)
        ],
        wrist_sigma_m=round(uncertainty.wrist_m, _DECIMALS),
        wrist_sigma_rad=round(uncertainty.wrist_rad, _DECIMALS),
    )


def _finger_pose(row: int, name: str, fingers: FingerSolution, sigma_rad: float) -> FingerPose:
    abduction, first, second, last = fingers.angles_rad[row].tolist()
    if name == "thumb":
        angles = FingerAngles(abduction=abduction, cmc=first, mcp=second, pip=0.0, dip=last)
    else:
        angles = FingerAngles(abduction=abduction, mcp=first, pip=second, dip=last)
    return FingerPose(
        name=name,  # type: ignore[arg-type]
        angles_rad=angles,
        residual_m=round(fingers.residual_m[row], _DECIMALS),
        iterations=fingers.iterations[row],
        status=fingers.status[row],
        sigma_rad=round(sigma_rad, _DECIMALS),
    )


def rounded(values: Array) -> list:
    """Nested lists of floats rounded for the wire, without negative zeros."""
    return (np.round(values, _DECIMALS) + 0.0).tolist()


@njit(cache=True)
def _rounded_frames(positions: Array, rotations: Array) -> Array:
    """Positions (n, 3) and quaternions wxyz of rotations (n, 3, 3) as `rounded`; (n, 7)."""
    quaternions = quaternions_from_rotations(rotations)
    numbers = np.empty((positions.shape[0], 7))
    for n in range(positions.shape[0]):
        for i in range(3):
            numbers[n, i] = np.rint(positions[n, i] * _UNITS) / _UNITS + 0.0
        for i in range(4):
            numbers[n, 3 + i] = np.rint(quaternions[n, i] * _UNITS) / _UNITS + 0.0
    return numbers


@njit(cache=True)
def rounded_within_limits(angles: Array, limits: Array) -> Array:
    """Angles (5, 4) as they go out: rounded, and still within limits (5, 4, 2).

    Rounding alone would cross a limit here and there.
    """
    inside = np.empty((5, 4))
    for row in range(5):
        for k in range(4):
            near = max(np.rint(angles[row, k] * _UNITS) / _UNITS, limits[row, k, 0])
            inside[row, k] = min(near, limits[row, k, 1]) + 0.0
    return inside


def joint_sources(
    measured: Collection[str], located: bool, digit_solved: list[bool]
) -> list[JointSource]:
    """Of each joint: measured, solved or predicted.

    Measured: its landmark was seen; solved: landmarks fix it; predicted: only the priors do.
    located: the wrist is fixed by landmarks; digit_solved (5,): the digit is.
    """
    result: list[JointSource] = []
    for joint, name in enumerate(JOINTS):
        row = _DIGIT_OF[joint]
        if name in measured:
            result.append("measured")
        else:
            result.append("solved" if located and (row < 0 or digit_solved[row]) else "predicted")
    return result


def pose_uncertainty(variances: Array, limits: Array) -> PoseUncertainty:
    """From the variances (26,) of a pose; limits (5, 4, 2) tell which angles can move.

    Half a turn and a metre say: unknown.
    """
    wrist_m, wrist_rad, *fingers_rad = _standard_deviations(variances, limits).tolist()
    return PoseUncertainty(
        wrist_m=min(wrist_m, 1.0),
        wrist_rad=min(wrist_rad, math.pi),
        fingers_rad=[min(sigma_rad, math.pi) for sigma_rad in fingers_rad],
    )


@njit(cache=True)
def _standard_deviations(variances: Array, limits: Array) -> Array:
    """Of the wrist's position and rotation, as lengths, and of each digit's angles (7,)."""
    found = np.zeros(7)
    for i in range(3):
        found[0] += max(variances[3 + i], 0.0)
        found[1] += max(variances[i], 0.0)
    for row in range(5):
        movable = 0
        for j in range(4):
            if limits[row, j, 1] > limits[row, j, 0]:
                angle = 6 + 4 * row + j
                movable += 1
                found[2 + row] += max(variances[angle], 0.0)
        found[2 + row] /= max(movable, 1)
    return np.sqrt(found)
