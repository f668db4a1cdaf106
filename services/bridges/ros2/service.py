"""The bridge to ROS 2: a node of rmw_zenoh's that publishes hands and objects.

PoseStamped of wrists and objects, JointState of fingers, TF and markers, each only while somebody
subscribes. ROS's router may be the rig's own or another; while it is away the bridge waits, and
what comes meanwhile is lost.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter

import zenoh

from rhot import clock
from rhot.bus.connecting import connected
from rhot.bus.security.credentials import client_endpoints, plain, with_certificates
from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.hand import HandName
from rhot.process.service import Service
from services.bridges.endpoints.feed import Feed
from services.bridges.pacing import Frame
from services.bridges.ros2 import topics
from services.bridges.ros2.encode import Placed, joint_state, static_transform
from services.bridges.ros2.frames import ros_from_camera, ros_from_rig
from services.bridges.ros2.keys import RosTopic
from services.bridges.ros2.markers import marker_array
from services.bridges.ros2.node import RosNode, RosPublisher
from services.bridges.unsent import Unsent

log = logging.getLogger("rhot.bridge")


async def serve(service: Service) -> None:
    """Publishes the rig's hands and objects to ROS 2."""
    config = service.config
    table = config.bridges.ros2
    check_names(config)
    endpoints = endpoints_of(config)
    where = ", ".join(map(plain, endpoints))
    service.status = f"waits for ROS 2's router at {where}"
    service.ready()
    session = await connected(endpoints, despite_certificates=True)
    try:
        node = RosNode(session, table.domain, table.distribution)
        rig = RigInRos(config, node)
        rig.tell_camera(clock.now_ns())
        service.status = f"publishing to ROS 2 at {where}, domain {table.domain}"
        log.info("%s", service.status)
        async for frame in Feed(service, table.rate_hz):
            service.values["subscribed_topics"] = rig.send(frame)
    finally:
        with contextlib.suppress(zenoh.ZError):
            await asyncio.to_thread(session.close)


def endpoints_of(config: RigConfig) -> list[str]:
    """Where ROS's router is: that of [bridges.ros2] connect, or the rig's own."""
    own = config.bridges.ros2.connect
    return (
        with_certificates(own, config.certificates_dir, "connect")
        if own
        else client_endpoints(config)
    )


def check_names(config: RigConfig) -> None:
    """Raises ConfigError if two objects have one name in ROS, which has fewer letters."""
    names = Counter(topics.object_pose(table.name).name for table in config.object)
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise ConfigError(
            f"two objects of rig.toml would both be {twice[0]} in ROS 2, whose names have letters, "
            "digits and _ alone; rename one"
        )


class RigInRos:
    """All that a rig publishes in ROS."""

    def __init__(self, config: RigConfig, node: RosNode) -> None:
        self._placed = Placed(ros_from_rig(config))
        self._T_ros_from_camera = ros_from_camera(config)
        self._tables = {table.name: table for table in config.object}
        self._unsent = Unsent()
        self._publishers: dict[RosTopic, RosPublisher] = {
            topic: node.publisher(topic) for topic in topics.all_topics(config)
        }
        self._static = self._publishers.pop(topics.TF_STATIC)

    def tell_camera(self, stamp_ns: int) -> None:
        """Where the camera is, once: who subscribes later gets it, too."""
        self._static.send(static_transform(self._T_ros_from_camera, stamp_ns))

    def send(self, frame: Frame) -> int:
        """Publish what is new and wanted; how many topics are."""
        wanted = {topic for topic, publisher in self._publishers.items() if publisher.wanted}
        hands, objects = self._unsent.hands(frame), self._unsent.objects(frame)
        if not hands and not objects:
            return len(wanted)
        for hand in hands:
            name: HandName = hand.hand
            if (topic := topics.wrist(name)) in wanted:
                at = hand.wrist
                message = self._placed.stamped(hand.stamp_ns, at.position_m, at.orientation_wxyz)
                self._publishers[topic].send(message)
            if (topic := topics.joints(name)) in wanted:
                self._publishers[topic].send(joint_state(hand))
        for one in objects:
            if (topic := topics.object_pose(one.object)) in wanted:
                message = self._placed.stamped(one.stamp_ns, one.position_m, one.orientation_wxyz)
                self._publishers[topic].send(message)
        if topics.TF in wanted:
            self._publishers[topics.TF].send(self._placed.transforms(hands, objects))
        if topics.MARKERS in wanted:
            markers = marker_array(self._placed, hands, objects, self._tables)
            self._publishers[topics.MARKERS].send(markers)
        return len(wanted)
