"""The bridge on a real router, seen as a ROS 2 node of rmw_zenoh's would see it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zenoh
import zenoh.ext
from rosbags.typesys import Stores, get_typestore

from rhot import topics as bus_topics
from rhot.bus.bus import client_config, router_config
from rhot.errors import ConfigError
from rhot.files.bridge_tables import Bridges, Ros2
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import Bus as BusTable
from rhot.files.rig_tables import ObjectTable
from services.bridges.ros2.service import check_names, serve
from testing.sample_hands import object_pose, random_pose
from testing.secured_rig import free_port

STAMP_NS = 1_700_000_000_123_456_789
POSE_HASH = "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"
TF_HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
WRIST = f"7/rhot/right_hand/wrist/geometry_msgs::msg::dds_::PoseStamped_/{POSE_HASH}"
STATIC = f"7/tf_static/tf2_msgs::msg::dds_::TFMessage_/{TF_HASH}"
STORE = get_typestore(Stores.ROS2_JAZZY)


def config_for(router: str) -> RigConfig:
    rig = load_rig(Path(__file__).parents[4] / "config" / "sim.toml")
    bridges = Bridges(ros2=Ros2(enabled=True, domain=7))
    return msgspec.structs.replace(rig, bridges=bridges, bus=BusTable(connect=(router,)))


async def until(found: Callable[[], Any], deadline_s: float = 30.0) -> Any:
    async with asyncio.timeout(deadline_s):
        while not (value := found()):
            await asyncio.sleep(0.02)
    return value


async def test_ros_sees_the_node_its_topics_and_what_they_say(router, running, sending):
    told: list[zenoh.Sample] = []
    pose = msgspec.structs.replace(random_pose("right", 3), stamp_ns=STAMP_NS)
    with zenoh.open(client_config([router])) as ros:
        subscriber = ros.declare_subscriber(WRIST, told.append)
        async with running("bridge", serve, config_for(router), instance="ros2") as (_, bus):
            publisher = bus.publisher(bus_topics.POSE, hand="right")
            with sending(lambda: publisher.put(pose)):
                await until(lambda: len(told) >= 1)
            # As `ros2 topic list` does.
            tokens = [
                str(reply.ok.key_expr).split("/")
                for reply in await asyncio.to_thread(ros.liveliness().get, "@ros2_lv/7/**")
            ]
            assert {(token[5], token[8]) for token in tokens} == {
                ("NN", "rhot_bridge"),
                ("MP", "rhot_bridge"),
            }
            listed = {token[9] for token in tokens if token[5] == "MP"}
            assert {"%tf", "%tf_static", "%rhot%markers", "%rhot%right_hand%wrist"} <= listed
            # Who comes later still learns where the camera is: as a transient local subscription.
            static: list[zenoh.Sample] = []
            late = zenoh.ext.declare_advanced_subscriber(
                ros,
                STATIC,
                static.append,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
            )
            await until(lambda: static)
            late.undeclare()
            subscriber.undeclare()
    message = STORE.deserialize_cdr(told[0].payload.to_bytes(), "geometry_msgs/msg/PoseStamped")
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == STAMP_NS
    x, y, z = pose.wrist.position_m
    at = message.pose.position
    assert (at.x, at.y, at.z) == pytest.approx((z, -x, -y))
    assert len(told[0].attachment.to_bytes()) == 33
    # One pose is told once, however often it came on the bus.
    assert len(told) == 1
    (transform,) = STORE.deserialize_cdr(
        static[0].payload.to_bytes(), "tf2_msgs/msg/TFMessage"
    ).transforms
    assert transform.child_frame_id == "rhot_camera_optical"


def test_objects_whose_names_would_be_one_in_ros_are_refused():
    rig = config_for("tcp/127.0.0.1:1")
    objects = [ObjectTable(name=name, serial=name) for name in ("a-b", "a.b")]
    with pytest.raises(ConfigError, match="rename one"):
        check_names(msgspec.structs.replace(rig, object=objects))
    check_names(rig)


async def test_the_bridge_waits_for_ros_router_and_outlives_it(router, running, sending):
    """ROS's router is another one here: it comes late, goes, and returns."""
    rig = config_for(router)
    ros_at = f"tcp/127.0.0.1:{free_port()}"
    table = Ros2(enabled=True, domain=7, connect=(ros_at,))
    config = msgspec.structs.replace(rig, bridges=Bridges(ros2=table))
    poses = iter(range(1, 1_000_000))
    async with running("bridge", serve, config, instance="ros2") as (service, bus):
        await until(lambda: "waits for ROS 2" in service.status)
        publisher = bus.publisher(bus_topics.OBJECT, object="cup")
        cup = object_pose("cup")

        def send() -> None:
            publisher.put(msgspec.structs.replace(cup, stamp_ns=next(poses)))

        key = f"7/rhot/object_cup/pose/geometry_msgs::msg::dds_::PoseStamped_/{POSE_HASH}"
        with sending(send):
            for _ in range(2):
                told: list[zenoh.Sample] = []
                ros = await asyncio.to_thread(zenoh.open, router_config([ros_at]))
                ros.declare_subscriber(key, told.append)
                await until(lambda told=told: len(told) > 3)
                tokens = list(await asyncio.to_thread(ros.liveliness().get, "@ros2_lv/7/**"))
                assert len(tokens) == 1 + 3 + 2 + len(config.object)
                await asyncio.to_thread(ros.close)
