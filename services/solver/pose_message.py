"""A solved hand as a HandPose message.

26 joints in OpenXR order, angles by name, where each value comes from and how sure it is.
"""

from __future__ import annotations

from collections.abc import Collection

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
from services.solver.finger.outcome import STATUSES
from services.solver.maths.chains import CHAINS
from services.solver.pose_numbers import DIGIT_ROWS, JOINT_ROWS, WRIST_ROW

# Of each joint: the digit whose chain it belongs to, -1 for those fixed to the wrist.
_DIGIT_OF = [next((row for row in range(5) if joint in CHAINS[row, 1:]), -1) for joint in range(26)]


def hand_pose(
    points: HandPoints,
    method: str,
    numbers: Array,
    radii_m: list[float],
    sources: list[JointSource],
) -> HandPose:
    """The message of numbers (32, 8), as pose_numbers.py has them; radii of the skin (26,)."""
    rows = numbers.tolist()
    parts = zip(JOINTS, rows[JOINT_ROWS], radii_m, sources, strict=True)
    joints = [
        HandJoint(
            name=name,
            position_m=(px, py, pz),
            orientation_wxyz=(w, x, y, z),
            radius_m=radius_m,
            source=source,
        )
        for name, (px, py, pz, w, x, y, z, _), radius_m, source in parts
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
            _finger_pose(name, row) for name, row in zip(DIGITS, rows[DIGIT_ROWS], strict=True)
        ],
        wrist_sigma_m=rows[WRIST_ROW][0],
        wrist_sigma_rad=rows[WRIST_ROW][1],
        model_misfit=rows[WRIST_ROW][2] if rows[WRIST_ROW][2] >= 0.0 else None,
    )


def _finger_pose(name: str, numbers: list[float]) -> FingerPose:
    abduction, first, second, last, residual_m, iterations, status, sigma_rad = numbers
    if name == "thumb":
        angles = FingerAngles(abduction=abduction, cmc=first, mcp=second, pip=0.0, dip=last)
    else:
        angles = FingerAngles(abduction=abduction, mcp=first, pip=second, dip=last)
    return FingerPose(
        name=name,  # type: ignore[arg-type]
        angles_rad=angles,
        residual_m=residual_m,
        iterations=int(iterations),
        status=STATUSES[int(status)],
        sigma_rad=sigma_rad,
    )


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
