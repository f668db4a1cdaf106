"""Numbers from the network that no hand has."""

from __future__ import annotations

import msgspec
import pytest

from rhot.messages import FingerAngles
from services.bridges.screening import hand_is_plausible, object_is_plausible
from testing.sample_hands import object_pose, random_pose

replace = msgspec.structs.replace


@pytest.mark.parametrize("seed", range(5))
def test_hands_and_objects_as_they_are_pass(seed):
    assert hand_is_plausible(random_pose("left", seed))
    assert object_is_plausible(object_pose())


@pytest.mark.parametrize(
    "wrong",
    [
        {"position_m": (1e300, 0.0, 0.0)},
        {"position_m": (0.0, float("nan"), 0.0)},
        {"orientation_wxyz": (0.0, 0.0, 0.0, 0.0)},
        {"orientation_wxyz": (1e200, 0.0, 0.0, 0.0)},
        {"orientation_wxyz": (1.0, 1.0, 0.0, 0.0)},
    ],
)
def test_a_joint_or_object_that_cannot_be_does_not(wrong):
    pose = random_pose("right", 1)
    joints = [*pose.joints[:7], replace(pose.joints[7], **wrong), *pose.joints[8:]]
    assert not hand_is_plausible(replace(pose, joints=joints))
    assert not hand_is_plausible(replace(pose, wrist=replace(pose.wrist, **wrong)))
    assert not object_is_plausible(object_pose(**wrong))


def test_an_angle_or_speed_that_cannot_be_does_not():
    pose = random_pose("right", 1)
    angles = FingerAngles(abduction=0.0, mcp=1e300, pip=0.0, dip=0.0)
    fingers = [*pose.fingers[:4], replace(pose.fingers[4], angles_rad=angles)]
    assert not hand_is_plausible(replace(pose, fingers=fingers))
    assert not object_is_plausible(object_pose(velocity_m_s=(0.0, -1e300, 0.0)))
