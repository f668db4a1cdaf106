"""The mapping to Unity's humanoid, against that convention's own definition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rhot.geometry.transforms import quaternion_from_rotation, rotation_from_vector
from rhot.hand import CHAIN_JOINTS, HANDS, default_hand
from services.bridges.vmc.skeleton import BONES, finger_bones, hand_bone
from testing.sample_hands import hand_pose, random_pose

# Unity's HumanBodyBones, as its documentation lists them.
UNITY = {
    f"{side}{digit}{joint}"
    for side in ("Left", "Right")
    for digit in ("Thumb", "Index", "Middle", "Ring", "Little")
    for joint in ("Proximal", "Intermediate", "Distal")
}
# Unity's axes: x right, y up, z forward, left-handed. The avatar faces +z.
DOWN, FORWARD = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
FINGERS = {"left": np.array([-1.0, 0.0, 0.0]), "right": np.array([1.0, 0.0, 0.0])}


def turned(rotation_xyzw, vector):
    """As Unity multiplies a Quaternion with a Vector3; its formula holds in either handedness."""
    x, y, z, w = rotation_xyzw
    u = np.array([x, y, z])
    return vector + 2.0 * np.cross(u, np.cross(u, vector) + w * vector)


def product(a_xyzw, b_xyzw):
    return (Rotation.from_quat(a_xyzw) * Rotation.from_quat(b_xyzw)).as_quat()


def flat(hand, **angles):
    """A hand turned and shifted anyhow, its angles (5, 4) zero but for what is given."""
    values = np.zeros((5, 4))
    for name, value in angles.items():
        values[1:, int(name[1])] = value
    turn = rotation_from_vector(np.array([0.3, -1.1, 0.7]))
    return hand_pose(default_hand(hand), turn, np.array([0.1, 0.2, 0.5]), values)


def test_the_names_are_unitys():
    names = {bone.name for hand in HANDS for bone in finger_bones(random_pose(hand, 0))}
    assert names == UNITY


@pytest.mark.parametrize("hand", HANDS)
def test_a_flat_hand_is_the_t_pose(hand):
    for bone in finger_bones(flat(hand)):
        assert bone.rotation_xyzw == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=1e-9)
        if "Thumb" not in bone.name and "Proximal" not in bone.name:
            # Along the arm, but for how far the fingers of a hand are spread.
            assert bone.position_m @ FINGERS[hand] > 0.95 * np.linalg.norm(bone.position_m)
    by_name = {bone.name[len(hand) :]: bone.position_m for bone in finger_bones(flat(hand))}
    # Palm down, thumb forward: index before little finger.
    assert np.array(by_name["IndexProximal"]) @ FORWARD > 0.0
    assert np.array(by_name["LittleProximal"]) @ FORWARD < 0.0
    assert np.array(by_name["ThumbIntermediate"]) @ FORWARD > 0.0


@pytest.mark.parametrize("hand", HANDS)
def test_fingers_curl_down_and_spread_forward(hand):
    """In T-pose the palm looks down: a finger that is curled by 90 degrees points down.

    About z for both hands, with opposite signs (left-handed axes: positive turns x to y).
    """
    curled = {b.name: b for b in finger_bones(flat(hand, a1=np.pi / 2))}
    name = f"{hand.capitalize()}MiddleProximal"
    assert turned(curled[name].rotation_xyzw, FINGERS[hand]) == pytest.approx(DOWN, abs=1e-6)
    sign = 1.0 if hand == "left" else -1.0
    assert curled[name].rotation_xyzw == pytest.approx((0, 0, sign * 0.5**0.5, 0.5**0.5), abs=1e-6)
    # Each joint on its own: the second one by 60 degrees is local to the first.
    bent = {b.name: b for b in finger_bones(flat(hand, a1=0.4, a2=np.pi / 3, a3=0.5))}
    for joint, angle in zip(BONES[2], (0.4, np.pi / 3, 0.5), strict=True):
        x, y, z, w = bent[f"{hand.capitalize()}{joint}"].rotation_xyzw
        assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert 2.0 * np.arctan2(z * sign, w) == pytest.approx(angle)
    # Towards the thumb is forward.
    spread = {b.name: b for b in finger_bones(flat(hand, a0=0.2))}
    moved = turned(spread[name].rotation_xyzw, FINGERS[hand])
    assert moved @ FORWARD == pytest.approx(np.sin(0.2), abs=1e-6)


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("seed", range(5))
def test_forward_kinematics_of_what_is_sent_gives_our_joints(hand, seed):
    """As Unity does it: local positions and rotations down the hierarchy, in its own axes."""
    pose = random_pose(hand, seed)
    bones = iter(finger_bones(pose))
    # The hand bone's own pose, from what hand_bone says of an arm in T-pose.
    root = hand_bone(hand, pose.wrist.orientation_wxyz).rotation_xyzw
    flip = np.diag([1.0, 1.0, -1.0])
    origin = flip @ pose.wrist.position_m
    flexed = default_hand(hand)
    for row, joints in enumerate(CHAIN_JOINTS):
        position, rotation = origin, np.array(root)
        for joint in joints[:3]:
            bone = next(bones)
            position = position + turned(rotation, np.array(bone.position_m))
            rotation = product(rotation, bone.rotation_xyzw)
            assert 1e3 * (flip @ position) == pytest.approx(
                1e3 * pose.positions_m[joint], abs=0.01
            ), bone.name
        # The last bone, as long as ours, ends at the tip: its direction at rest is the one before.
        rest = np.array(bone.position_m) / np.linalg.norm(bone.position_m)
        tip = position + turned(rotation, rest * flexed.lengths_m[row, 2])
        assert 1e3 * (flip @ tip) == pytest.approx(1e3 * pose.positions_m[joints[3]], abs=0.1)


@pytest.mark.parametrize("hand", HANDS)
def test_the_hand_bone_is_identity_in_t_pose(hand):
    # The wrist's -z along the arm, its y up: what the T-pose is in OpenXR's axes.
    back, up = -FINGERS[hand], np.array([0.0, 1.0, 0.0])
    wrist = np.stack([np.cross(up, back), up, back], axis=1)
    bone = hand_bone(hand, tuple(quaternion_from_rotation(wrist)))
    assert bone.rotation_xyzw == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=1e-9)
    assert np.array(bone.position_m) @ FINGERS[hand] == pytest.approx(0.255)
