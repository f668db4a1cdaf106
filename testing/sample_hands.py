"""Solved hands as messages: for given angles and a wrist, exactly where forward kinematics puts
them.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array, quaternion_from_rotation, rotation_from_vector
from rhot.hand import DIGITS, JOINTS, HandModel, HandName, default_hand, forward, joint_radii_m
from rhot.messages import FingerAngles, FingerPose, HandJoint, HandPose, WristPose
from rhot.messages.objects import ObjectPose


def hand_pose(
    model: HandModel,
    wrist_rotation: Array,
    wrist_m: Array,
    angles_rad: Array,
    *,
    stamp_ns: int = 0,
    seq: int = 0,
) -> HandPose:
    """A hand's message; wrist_rotation (3, 3), wrist_m (3,) in the rig frame, angles (5, 4)."""
    positions, rotations = forward(model, wrist_rotation, wrist_m, angles_rad)
    joints = [
        HandJoint(
            name=name,
            position_m=tuple(position.tolist()),
            orientation_wxyz=tuple(quaternion_from_rotation(rotation).tolist()),
            radius_m=float(radius),
            source="solved",
        )
        for name, position, rotation, radius in zip(
            JOINTS, positions, rotations, joint_radii_m(model), strict=True
        )
    ]
    return HandPose(
        hand=model.hand,
        seq=seq,
        stamp_ns=stamp_ns,
        method="dls",
        wrist=WristPose(
            position_m=tuple(wrist_m.tolist()),
            orientation_wxyz=tuple(quaternion_from_rotation(wrist_rotation).tolist()),
        ),
        joints=joints,
        fingers=[_finger(name, row) for name, row in zip(DIGITS, angles_rad.tolist(), strict=True)],
    )


def random_pose(hand: HandName, seed: int) -> HandPose:
    """A hand within its limits, turned any way, somewhere before the cameras."""
    random = np.random.default_rng(seed)
    model = default_hand(hand)
    low, high = model.limits_rad[..., 0], model.limits_rad[..., 1]
    turn = rotation_from_vector(random.normal(size=3))
    return hand_pose(model, turn, random.uniform(-0.3, 0.6, 3), random.uniform(low, high))


def object_pose(name: str = "cup", **fields: object) -> ObjectPose:
    """A registered object that is tracked; any field replaceable."""
    values: dict[str, object] = {
        "object": name,
        "serial": "LHR-1",
        "seq": 0,
        "stamp_ns": 0,
        "position_m": (0.02, 0.05, 0.4),
        "orientation_wxyz": (1.0, 0.0, 0.0, 0.0),
        "velocity_m_s": (0.0, 0.0, 0.0),
        "angular_velocity_rad_s": (0.0, 0.0, 0.0),
        "tracking": "ok",
        "registered": True,
    }
    return ObjectPose(**(values | fields))  # type: ignore[arg-type]


def _finger(name: str, angles: list[float]) -> FingerPose:
    first, second, third, fourth = angles
    named = (
        FingerAngles(abduction=first, cmc=second, mcp=third, pip=0.0, dip=fourth)
        if name == "thumb"
        else FingerAngles(abduction=first, mcp=second, pip=third, dip=fourth)
    )
    return FingerPose(
        name=name,  # type: ignore[arg-type]
        angles_rad=named,
        residual_m=0.0,
        iterations=1,
        status="solved",
    )
