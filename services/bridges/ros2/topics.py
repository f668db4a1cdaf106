"""The topics of ROS 2 that a rig has: names and types, by the rig's hands and objects. Pure."""

from __future__ import annotations

from rhot.files.config import RigConfig
from rhot.hand import HandName
from services.bridges.ros2.keys import RosTopic

TF = RosTopic("/tf", "tf2_msgs/msg/TFMessage", depth=100)
TF_STATIC = RosTopic("/tf_static", "tf2_msgs/msg/TFMessage", depth=1, kept=True)
MARKERS = RosTopic("/rhot/markers", "visualization_msgs/msg/MarkerArray")


def wrist(hand: HandName) -> RosTopic:
    """A hand's wrist."""
    return RosTopic(f"/rhot/{hand}_hand/wrist", "geometry_msgs/msg/PoseStamped")


def joints(hand: HandName) -> RosTopic:
    """The angles of a hand's joints."""
    return RosTopic(f"/rhot/{hand}_hand/joint_states", "sensor_msgs/msg/JointState")


def object_pose(name: str) -> RosTopic:
    """An object; ROS's names have neither `-` nor `.`"""
    safe = "".join(c if c.isalnum() and c.isascii() else "_" for c in name)
    return RosTopic(f"/rhot/object_{safe}/pose", "geometry_msgs/msg/PoseStamped")


def all_topics(config: RigConfig) -> list[RosTopic]:
    """Every topic that the bridge of this rig publishes."""
    hands: list[HandName] = list(config.hand)
    return [
        TF,
        TF_STATIC,
        MARKERS,
        *(topic(hand) for hand in hands for topic in (wrist, joints)),
        *(object_pose(table.name) for table in config.object),
    ]
