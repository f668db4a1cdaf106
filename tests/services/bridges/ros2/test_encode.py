"""Bytes on the wire, read with rosbags' own deserialiser: units, frames, handedness."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import ObjectTable, World
from rhot.geometry.transforms import apply, rotation_from_quaternion
from rhot.hand import JOINT_INDEX, JOINTS
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose
from services.bridges.ros2.encode import Placed, cdr, joint_state, static_transform
from services.bridges.ros2.frames import ros_from_camera, ros_from_rig
from services.bridges.ros2.markers import marker_array
from testing.hand_stream import pose_at

STAMP_NS = 1_700_000_000_123_456_789
# Where REP 103 has x forward, y left, z up and the camera x right, y down, z forward.
FORWARD, LEFT, UP = np.eye(3)
CUP = ObjectPose(
    object="cup",
    serial="LHR-1",
    seq=1,
    stamp_ns=STAMP_NS,
    position_m=(0.1, -0.2, 0.6),
    orientation_wxyz=(1.0, 0.0, 0.0, 0.0),
    velocity_m_s=(0.0, 0.0, 0.0),
    angular_velocity_rad_s=(0.0, 0.0, 0.0),
    tracking="ok",
    registered=True,
)


@pytest.fixture(scope="module")
def rig() -> RigConfig:
    return load_rig(Path(__file__).parents[4] / "config" / "sim.toml")


@pytest.fixture(scope="module")
def pose() -> HandPose:
    return pose_at(0.3, STAMP_NS, 5)


@pytest.fixture(scope="module", params=[Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY])
def read(request: pytest.FixtureRequest) -> Any:
    """A reader of bytes, as Humble and as Jazzy define the messages."""
    store = get_typestore(request.param)

    def decode(message: Any) -> Any:
        return store.deserialize_cdr(cdr(message), message.__msgtype__)

    return decode


def xyz(vector: Any) -> np.ndarray:
    return np.array([vector.x, vector.y, vector.z])


def rotation(quaternion: Any) -> np.ndarray:
    return rotation_from_quaternion((quaternion.w, quaternion.x, quaternion.y, quaternion.z))


def placed(config: RigConfig) -> Placed:
    return Placed(ros_from_rig(config))


def test_a_pose_is_turned_into_ros_axes(rig: RigConfig, read: Any):
    message = read(placed(rig).stamped(STAMP_NS, CUP.position_m, (1.0, 0.0, 0.0, 0.0)))
    assert message.header.frame_id == "rhot_rig"
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == STAMP_NS
    # 0.6 m before the camera, 0.1 m to its right, 0.2 m above its axis.
    np.testing.assert_allclose(
        xyz(message.pose.position), 0.6 * FORWARD - 0.1 * LEFT + 0.2 * UP, atol=1e-12
    )
    axes = rotation(message.pose.orientation)
    np.testing.assert_allclose(axes, np.stack([-LEFT, -UP, FORWARD], axis=1), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_the_static_transform_is_that_of_an_optical_frame(rig: RigConfig, read: Any):
    (found,) = read(static_transform(ros_from_camera(rig), STAMP_NS)).transforms
    assert (found.header.frame_id, found.child_frame_id) == ("rhot_rig", "rhot_camera_optical")
    # The quaternion of every ROS camera driver: (-.5, .5, -.5, .5), either sign.
    q = found.transform.rotation
    np.testing.assert_allclose(
        np.array([q.x, q.y, q.z, q.w]) * np.sign(q.w), [-0.5, 0.5, -0.5, 0.5], atol=1e-12
    )
    np.testing.assert_allclose(xyz(found.transform.translation), 0.0, atol=1e-12)


def test_a_world_frame_is_ros_frame(rig: RigConfig, read: Any):
    """`rhot calibrate world` makes z point up: nothing is turned, and the camera stands in it."""
    rows = (
        (1.0, 0.0, 0.0, 0.1),
        (0.0, 0.0, 1.0, -0.5),
        (0.0, -1.0, 0.0, 0.3),
        (0.0, 0.0, 0.0, 1.0),
    )
    table = msgspec.structs.replace(rig.rig, world=World(T_rig_from_camera=rows))
    config = msgspec.structs.replace(rig, rig=table)
    message = read(placed(config).stamped(STAMP_NS, CUP.position_m, (0.5, 0.5, -0.5, 0.5)))
    np.testing.assert_allclose(xyz(message.pose.position), CUP.position_m)
    (found,) = read(static_transform(ros_from_camera(config), STAMP_NS)).transforms
    moved = rotation(found.transform.rotation) @ FORWARD + xyz(found.transform.translation)
    np.testing.assert_allclose(moved, apply(np.array(rows), FORWARD), atol=1e-12)


def test_all_joints_have_frames(rig: RigConfig, pose: HandPose, read: Any):
    found = read(placed(rig).transforms([pose], [CUP])).transforms
    assert [one.child_frame_id for one in found] == [
        *(f"right_hand/{name}" for name in JOINTS),
        "object_cup",
    ]
    T = ros_from_rig(rig)
    for one, joint in zip(found, pose.joints, strict=False):
        np.testing.assert_allclose(
            xyz(one.transform.translation), apply(T, joint.position_m), atol=1e-12
        )
        np.testing.assert_allclose(
            rotation(one.transform.rotation),
            T[:3, :3] @ rotation_from_quaternion(joint.orientation_wxyz),
            atol=1e-12,
        )


def test_a_right_hand_stays_one(rig: RigConfig, pose: HandPose, read: Any):
    """In OpenXR's axes: the fingers lie at -z of the wrist, the thumb of a right hand at -x."""
    found = read(placed(rig).transforms([pose], [])).transforms
    wrist = found[JOINT_INDEX["wrist"]].transform
    for name, axis in (("middle_proximal", 2), ("thumb_proximal", 0)):
        at = xyz(found[JOINT_INDEX[name]].transform.translation) - xyz(wrist.translation)
        assert (rotation(wrist.rotation).T @ at)[axis] < -0.02


def test_joint_states_are_the_angles_by_name(pose: HandPose, read: Any):
    message = read(joint_state(pose))
    named = dict(zip(message.name, message.position, strict=True))
    assert len(named) == 20
    assert named["right_index_pip"] == pose.finger("index").angles_rad.pip
    assert named["right_thumb_cmc"] == pose.finger("thumb").angles_rad.cmc
    assert named["right_little_abduction"] == pose.finger("little").angles_rad.abduction
    assert len(message.velocity) == len(message.effort) == 0


def test_markers_draw_hands_and_shapes(rig: RigConfig, pose: HandPose, read: Any):
    table = ObjectTable(name="cup", serial="LHR-1", shape="cylinder", size_m=(0.07, 0.1))
    markers = read(marker_array(placed(rig), [pose], [CUP], {"cup": table})).markers
    joints, bones, cup = markers
    T = ros_from_rig(rig)
    assert (joints.ns, joints.type, bones.type) == ("right_hand", 7, 5)
    # A list's points are turned by the marker's own pose.
    drawn = np.array([xyz(p) for p in joints.points]) @ rotation(joints.pose.orientation).T
    np.testing.assert_allclose(drawn, apply(T, pose.positions_m), atol=1e-12)
    assert len(bones.points) == 2 * 24
    assert bones.lifetime.nanosec == 500_000_000
    assert (cup.ns, cup.type) == ("object_cup", 3)
    assert (cup.scale.x, cup.scale.y, cup.scale.z) == (0.07, 0.07, 0.1)
    # Its height, ROS's z, is our y: down in the camera's frame.
    np.testing.assert_allclose(np.abs(rotation(cup.pose.orientation)[:, 2]), UP, atol=1e-12)


def test_other_shapes(rig: RigConfig, read: Any):
    for shape, size, kind, scale in (
        ("box", (0.1, 0.2, 0.3), 1, (0.1, 0.2, 0.3)),
        ("sphere", (0.05,), 2, (0.05, 0.05, 0.05)),
        ("", (), 2, (0.03, 0.03, 0.03)),
    ):
        table = ObjectTable(name="cup", serial="LHR-1", shape=shape, size_m=size)
        (marker,) = read(marker_array(placed(rig), [], [CUP], {"cup": table})).markers
        assert marker.type == kind
        np.testing.assert_allclose(xyz(marker.scale), scale)
