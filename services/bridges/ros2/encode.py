"""Hands and objects as ROS 2's messages, in CDR by rosbags. Pure.

Metres, radians, quaternions xyzw, all in `rhot_rig` (services/bridges/ros2/frames.py); stamps are
the messages' own, on the master's clock. A message's bytes are CDR in little endian with its header
of four bytes, which is what rmw_zenoh carries.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from rhot.geometry.transforms import Array, apply, quaternion_from_rotation
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINTS, HandName
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose
from services.bridges.ros2.frames import CAMERA, RIG, joint_frame, object_frame
from services.bridges.ros2.keys import NO_HASH, Distribution, RosTopic

# Of Humble and Jazzy alike: the four types are the same in both (tests compare their hashes).
_STORE = Stores.ROS2_JAZZY
_NOTHING = np.zeros(0)
# Of geometry_msgs/msg, in the order of their fields.
_PARTS = ("Point", "Quaternion", "Pose")
_MOVES = ("TransformStamped", "Transform", "Vector3")


@cache
def store() -> Typestore:
    """The definitions of ROS's messages; read once, which takes .2 s."""
    return get_typestore(_STORE)


def type_hash(topic: RosTopic, distribution: Distribution) -> str:
    """A type's hash as it stands in keys: RIHS01 of its definition (REP 2011); Humble has none."""
    return NO_HASH if distribution == "humble" else store().hash_rihs01(topic.type)


def make(kind: str, **fields: Any) -> Any:
    """A message of ROS's, by the name of its type: geometry_msgs/msg/Pose."""
    return store().types[kind](**fields)


def cdr(message: Any) -> bytes:
    """A message's bytes on the wire."""
    return bytes(store().serialize_cdr(message, message.__msgtype__))


class Placed:
    """Makes what stands somewhere: from the rig's frame into ROS's."""

    def __init__(self, T_ros_from_rig: Array) -> None:
        self._T = T_ros_from_rig
        self._turn_wxyz = quaternion_from_rotation(T_ros_from_rig[:3, :3])

    def poses(self, positions_m: npt.ArrayLike, orientations_wxyz: npt.ArrayLike) -> list[Any]:
        """geometry_msgs/msg/Pose of each pose (n, 3) and (n, 4) in the rig frame."""
        places = apply(self._T, positions_m).tolist()
        turns = _turned(self._turn_wxyz, np.asarray(orientations_wxyz)).tolist()
        types = store().types
        Point, Quaternion, Pose = (types[f"geometry_msgs/msg/{name}"] for name in _PARTS)
        return [
            Pose(Point(*place), Quaternion(x, y, z, w))
            for place, (w, x, y, z) in zip(places, turns, strict=True)
        ]

    def stamped(
        self, stamp_ns: int, position_m: Sequence[float], orientation_wxyz: Sequence[float]
    ) -> Any:
        """geometry_msgs/msg/PoseStamped of a pose in the rig frame."""
        (pose,) = self.poses([position_m], [orientation_wxyz])
        return make("geometry_msgs/msg/PoseStamped", header=header(stamp_ns), pose=pose)

    def transforms(self, hands: Iterable[HandPose], objects: Iterable[ObjectPose]) -> Any:
        """tf2_msgs/msg/TFMessage: each joint and each object on `rhot_rig`."""
        found = []
        for hand in hands:
            names = [joint_frame(hand.hand, joint) for joint in JOINTS]
            poses = self.poses(hand.positions_m, hand.orientations_wxyz)
            found += _transforms(hand.stamp_ns, names, poses)
        for one in objects:
            poses = self.poses([one.position_m], [one.orientation_wxyz])
            found += _transforms(one.stamp_ns, [object_frame(one.object)], poses)
        return make("tf2_msgs/msg/TFMessage", transforms=found)


def joint_names(hand: HandName) -> list[str]:
    """Names of the 20 angles, thumb to little: right_index_mcp."""
    return [
        f"{hand}_{digit}_{angle}"
        for digit, angles in zip(DIGITS, DIGIT_ANGLES, strict=True)
        for angle in angles
    ]


def joint_state(hand: HandPose) -> Any:
    """sensor_msgs/msg/JointState: the angles in radians, flexion positive towards the palm,
    abduction towards the thumb's side; no velocities and no efforts.
    """
    return make(
        "sensor_msgs/msg/JointState",
        header=header(hand.stamp_ns),
        name=joint_names(hand.hand),
        position=hand.angles_rad.ravel(),
        velocity=_NOTHING,
        effort=_NOTHING,
    )


def static_transform(T_ros_from_camera: Array, stamp_ns: int) -> Any:
    """tf2_msgs/msg/TFMessage with where the first camera is, for /tf_static."""
    poses = Placed(T_ros_from_camera).poses(np.zeros((1, 3)), [[1.0, 0.0, 0.0, 0.0]])
    return make("tf2_msgs/msg/TFMessage", transforms=_transforms(stamp_ns, [CAMERA], poses))


def header(stamp_ns: int) -> Any:
    """std_msgs/msg/Header in `rhot_rig`."""
    sec, nanosec = divmod(stamp_ns, 10**9)
    stamp = make("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=RIG)


def _transforms(stamp_ns: int, children: Sequence[str], poses: Sequence[Any]) -> list[Any]:
    types, same = store().types, header(stamp_ns)
    Stamped, Transform, Vector = (types[f"geometry_msgs/msg/{name}"] for name in _MOVES)
    return [
        Stamped(
            same,
            child,
            Transform(Vector(pose.position.x, pose.position.y, pose.position.z), pose.orientation),
        )
        for child, pose in zip(children, poses, strict=True)
    ]


def _turned(turn_wxyz: Array, orientations_wxyz: Array) -> Array:
    """Hamilton products turn * q of many unit quaternions, with w >= 0; (4,), (n, 4) -> (n, 4)."""
    w, v = orientations_wxyz[:, :1], orientations_wxyz[:, 1:]
    a, u = turn_wxyz[0], turn_wxyz[1:]
    real = a * w - v @ u[:, None]
    turned = np.hstack([real, a * v + w * u + np.cross(u, v)])
    return np.where(real < 0.0, -turned, turned)
