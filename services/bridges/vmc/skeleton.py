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

import math
from typing import NamedTuple

from rhot.geometry.quaternions import (
    Quat,
    Vec3,
    conjugate,
    from_vector,
    multiply,
    normalized,
    rotate,
)
from rhot.hand import CHAIN_JOINTS, HandName
from rhot.messages import HandPose

# Unity's HumanBodyBones of the three joints of each digit, thumb to little, without Left or Right.
BONES = tuple(
    tuple(f"{digit}{joint}" for joint in ("Proximal", "Intermediate", "Distal"))
    for digit in ("Thumb", "Index", "Middle", "Ring", "Little")
)
# From the wrist frame (-z along the fingers, +y out of the back of the hand) to the avatar's axes
# in T-pose, right-handed with y up and z backward.
T_POSE: dict[HandName, Quat] = {
    "left": from_vector(0.0, math.pi / 2, 0.0),
    "right": from_vector(0.0, -math.pi / 2, 0.0),
}
# From the elbow to the wrist in T-pose, for the bone of the hand: .146 of a stature of 1.75 m
# (Drillis and Contini, 1966).
_FOREARM_M = 0.255
_STRAIGHT: Quat = (1.0, 0.0, 0.0, 0.0)
_JOINTS: list[list[int]] = CHAIN_JOINTS[:, :3].tolist()


class BonePose(NamedTuple):
    """A bone in its parent's frame, in Unity's left-handed axes; metres, quaternion xyzw."""

    name: str
    position_m: tuple[float, float, float]
    rotation_xyzw: tuple[float, float, float, float]


def finger_bones(pose: HandPose) -> list[BonePose]:
    """The 15 bones of a hand's fingers, parents before their children."""
    side = "Left" if pose.hand == "left" else "Right"
    # From the rig to the avatar's axes at a hand that rests.
    turn = multiply(T_POSE[pose.hand], conjugate(pose.wrist.orientation_wxyz))
    bones = []
    for names, joints, finger in zip(BONES, _JOINTS, pose.fingers, strict=True):
        axes = [multiply(turn, pose.joints[j].orientation_wxyz) for j in joints]
        abduction, flexion, *_ = finger.model_angles_rad
        rest = multiply(axes[0], _turned_back(abduction, flexion, pose.hand))
        parent, origin = _STRAIGHT, pose.wrist.position_m
        for name, joint, own in zip(names, joints, axes, strict=True):
            rotation, to_parent = multiply(own, conjugate(rest)), conjugate(parent)
            position = pose.joints[joint].position_m
            step = rotate(turn, _difference(position, origin))
            local = normalized(multiply(to_parent, rotation))
            bones.append(_bone(f"{side}{name}", rotate(to_parent, step), local))
            parent, origin = rotation, position
    return bones


def hand_bone(hand: HandName, wrist_wxyz: Quat) -> BonePose:
    """The hand itself, on an arm in T-pose; wrist_wxyz in the program's space, y up."""
    elbow_to_wrist = rotate(T_POSE[hand], (0.0, 0.0, -_FOREARM_M))
    turn = normalized(multiply(wrist_wxyz, conjugate(T_POSE[hand])))
    return _bone(f"{'Left' if hand == 'left' else 'Right'}Hand", elbow_to_wrist, turn)


def _bone(name: str, position_m: Vec3, rotation_wxyz: Quat) -> BonePose:
    """The same in Unity's axes: z, and with it the sense of turns about x and y, changes sign."""
    (right, up, back), (w, x, y, z) = position_m, rotation_wxyz
    return BonePose(name, (right, up, -back), (-x, -y, z, w))


def _turned_back(abduction: float, flexion: float, hand: HandName) -> Quat:
    """From a digit's first bone as it is turned by its first two angles to where these are zero."""
    side = 1.0 if hand == "right" else -1.0
    return multiply(from_vector(flexion, 0.0, 0.0), from_vector(0.0, -side * abduction, 0.0))


def _difference(a: Vec3, b: Vec3) -> Vec3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
