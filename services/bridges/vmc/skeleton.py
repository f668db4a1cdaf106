"""A hand as Unity's humanoid has it: names, rest pose, left-handed axes. Pure.

Unity's frame is left-handed: x right, y up, z forward; ours with y up is right-handed with z
backward, so that z changes its sign. A bone's pose is local, in its parent's frame. In the rest
pose, the T-pose of VRM, all bones have identity rotations while the avatar faces +z with its arms
to its sides, palms down: the left hand's fingers point to -x, the right hand's to +x, thumbs
forward. So a bone's axes are the avatar's own, not ours along the bone.

A finger rests where its angles are zero, and what is sent is how it is turned away from there. An
avatar's fingers keep their own rest directions so, and forward kinematics of what is sent, bone
lengths included, puts our joints where they are: tests/services/bridges/vmc/test_skeleton.py. The
metacarpals do not exist in Unity; the thumb's is its ThumbProximal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_x,
    rotation_y,
)
from rhot.hand import CHAIN_JOINTS, HandName
from rhot.messages import HandPose

# Unity's HumanBodyBones of the three joints of each digit, thumb to little, without Left or Right.
BONES = tuple(
    tuple(f"{digit}{joint}" for joint in ("Proximal", "Intermediate", "Distal"))
    for digit in ("Thumb", "Index", "Middle", "Ring", "Little")
)
# From the wrist frame (-z along the fingers, +y out of the back of the hand) to the avatar's axes
# in T-pose, right-handed with y up and z backward; (3, 3).
T_POSE: dict[HandName, Array] = {"left": rotation_y(np.pi / 2), "right": rotation_y(-np.pi / 2)}
# From the elbow to the wrist in T-pose, for the bone of the hand: .146 of a stature of 1.75 m
# (Drillis and Contini, 1966).
_FOREARM_M = 0.255


class BonePose(NamedTuple):
    """A bone in its parent's frame, in Unity's left-handed axes; metres, quaternion xyzw."""

    name: str
    position_m: tuple[float, float, float]
    rotation_xyzw: tuple[float, float, float, float]


def finger_bones(pose: HandPose) -> list[BonePose]:
    """The 15 bones of a hand's fingers, parents before their children."""
    side = "Left" if pose.hand == "left" else "Right"
    to_avatar = T_POSE[pose.hand]
    wrist = rotation_from_quaternion(pose.wrist.orientation_wxyz)
    # From the rig to the avatar's axes at a hand that rests.
    turn = to_avatar @ wrist.T
    positions = (pose.positions_m - pose.wrist.position_m) @ turn.T
    bones = []
    for names, joints, angles in zip(BONES, CHAIN_JOINTS, pose.angles_rad, strict=True):
        axes = [turn @ rotation_from_quaternion(pose.joints[j].orientation_wxyz) for j in joints]
        rest = axes[0] @ _turned_back(angles, pose.hand)
        parent, origin = np.eye(3), np.zeros(3)
        for name, joint, own in zip(names, joints, axes, strict=False):
            rotation = own @ rest.T
            offset = parent.T @ (positions[joint] - origin)
            bones.append(bone(f"{side}{name}", offset, parent.T @ rotation))
            parent, origin = rotation, positions[joint]
    return bones


def hand_bone(hand: HandName, wrist_rotation: Array) -> BonePose:
    """The hand itself, on an arm in T-pose; wrist_rotation (3, 3) in the program's space, y up."""
    side = "Left" if hand == "left" else "Right"
    to_avatar = T_POSE[hand]
    elbow_to_wrist = to_avatar @ np.array([0.0, 0.0, -_FOREARM_M])
    return bone(f"{side}Hand", elbow_to_wrist, wrist_rotation @ to_avatar.T)


def bone(name: str, position_m: Array, rotation: Array) -> BonePose:
    """The same in Unity's axes: z, and with it the sense of turns about x and y, changes sign."""
    w, x, y, z = quaternion_from_rotation(rotation).tolist()
    right, up, back = position_m.tolist()
    return BonePose(name, (right, up, -back), (-x, -y, z, w))


def _turned_back(angles_rad: Array, hand: HandName) -> Array:
    """From a digit's first bone as it is turned by its first two angles to where these are zero."""
    abduction, flexion = angles_rad[0], angles_rad[1]
    side = 1.0 if hand == "right" else -1.0
    return rotation_x(flexion) @ rotation_y(-side * abduction)
