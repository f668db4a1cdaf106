"""rhot's own recordings: truth.jsonl of a simulated capture, poses.jsonl of `rhot track`. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from rhot.errors import UNDECODABLE, CaptureError
from rhot.files.capture import read_lines
from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import CHAIN_JOINTS, DIGIT_ANGLES, DIGITS, JOINTS, HandName
from rhot.messages import HandPose, WristPose
from rhot.messages.simulator import HandTruth, Truth
from services.simulator.recorded_motion.recording import RecordedJoints, usable_rows

_CHAIN = CHAIN_JOINTS.ravel().tolist()


class _Row(NamedTuple):
    """One frame of one hand: joints (5, 4, 3), angles (5, 4)."""

    stamp_ns: int
    wrist: WristPose
    joints_m: Array
    angles_rad: Sequence[Sequence[float]]


def read_rhot(path: Path, first_line: bytes) -> RecordedJoints:
    """The hand with most lines, the right one of two that have as many.

    Raises CaptureError naming the line that is neither a Truth nor a HandPose.
    """
    rows: dict[HandName, list[_Row]] = {"right": [], "left": []}
    if _is_truth(first_line, path):
        for truth in read_lines(path, Truth):
            for hand, found in rows.items():
                if hand in truth.hands:
                    found.append(_truth_row(truth.stamp_ns, truth.hands[hand], path))
    else:
        for pose in read_lines(path, HandPose):
            rows[pose.hand].append(_pose_row(pose))
    hand = max(rows, key=lambda name: len(rows[name]))
    if not rows[hand]:
        raise CaptureError(f"{path}: has no hand; give a recording with one")
    return _recording(hand, rows[hand], str(path))


def _is_truth(line: bytes, path: Path) -> bool:
    """Whether the lines are Truth; HandPose otherwise."""
    try:
        fields = msgspec.json.decode(line, type=dict[str, msgspec.Raw])
    except UNDECODABLE as error:
        raise CaptureError(f"{path}: line 1: is no JSON object: {error}") from None
    if "hands" not in fields and "joints" not in fields:
        raise CaptureError(
            f"{path}: line 1: is neither a line of truth.jsonl nor of poses.jsonl; a motion needs"
            " all joints of a hand, which markers and points have not"
        )
    return "hands" in fields


def _truth_row(stamp_ns: int, truth: HandTruth, path: Path) -> _Row:
    try:
        joints = np.array([truth.points_m[JOINTS[joint]] for joint in _CHAIN])
        angles = [
            [getattr(truth.angles_rad[digit], name) for name in names]
            for digit, names in zip(DIGITS, DIGIT_ANGLES, strict=True)
        ]
    except KeyError as error:
        raise CaptureError(
            f"{path}: a hand's truth lacks {error}; a motion needs all joints and angles"
        ) from None
    return _Row(stamp_ns, truth.wrist, joints.reshape(5, 4, 3), angles)


def _pose_row(pose: HandPose) -> _Row:
    joints = np.array([pose.joints[joint].position_m for joint in _CHAIN])
    angles = [finger.model_angles_rad for finger in pose.fingers]
    return _Row(pose.stamp_ns, pose.wrist, joints.reshape(5, 4, 3), angles)


def _recording(hand: HandName, rows: list[_Row], name: str) -> RecordedJoints:
    start_ns = rows[0].stamp_ns
    times_s = np.array([(row.stamp_ns - start_ns) * 1e-9 for row in rows])
    kept = [rows[k] for k in usable_rows(times_s, name)]
    return RecordedJoints(
        hand=hand,
        times_s=np.array([(row.stamp_ns - kept[0].stamp_ns) * 1e-9 for row in kept]),
        joints_m=np.array([row.joints_m for row in kept]),
        origin_m=np.array([row.wrist.position_m for row in kept]),
        axes=np.array([rotation_from_quaternion(row.wrist.orientation_wxyz) for row in kept]),
        is_wrist=True,
        angles_rad=np.array([row.angles_rad for row in kept]),
    )
