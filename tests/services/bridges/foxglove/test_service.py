"""Foxglove's channels through a WebSocket client that speaks foxglove.sdk.v1, written from the
protocol's public specification; messages are decoded by the schemas that the server advertises.
"""

from __future__ import annotations

import asyncio
import base64
import json
import struct
from pathlib import Path
from typing import Any

import foxglove
import msgspec
import numpy as np
import pytest
from websockets.asyncio.client import connect

from rhot import topics
from rhot.errors import BusError, ConfigError
from rhot.files.bridge_tables import Bridges, Foxglove
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import ObjectTable
from rhot.hand import JOINT_INDEX
from rhot.messages import HandPose
from services.bridges.foxglove import service as foxglove_service
from services.bridges.foxglove.service import serve
from testing.protobuf_wire import Schema
from testing.sample_hands import object_pose, random_pose

FIRST = ("/tf", "/hands", "/objects", "/rhot/hand/right/pose")
STAMP_NS = 1_700_000_000_123_456_789
POSE = msgspec.structs.replace(random_pose("right", 4), stamp_ns=STAMP_NS)
CUP = object_pose("cup", stamp_ns=STAMP_NS, seq=3)


class Client:
    """Subscribes to channels by their topics, and decodes what comes."""

    def __init__(self, connection: Any, channels: list[dict[str, Any]]) -> None:
        self.connection = connection
        self.channels = {channel["topic"]: channel for channel in channels}

    @classmethod
    async def of(cls, connection: Any) -> Client:
        info = json.loads(await connection.recv())
        assert (info["op"], info["name"]) == ("serverInfo", "rhot")
        told = json.loads(await connection.recv())
        assert told["op"] == "advertise"
        return cls(connection, told["channels"])

    async def first(self, topic: str) -> tuple[int, Any]:
        """The next message of a topic, and the time it was logged at."""
        channel = self.channels[topic]
        asked = {"id": channel["id"], "channelId": channel["id"]}
        await self.connection.send(json.dumps({"op": "subscribe", "subscriptions": [asked]}))
        while True:
            content = await self.connection.recv()
            if isinstance(content, str):
                continue
            opcode, number, time_ns = struct.unpack_from("<BIQ", content)
            if (opcode, number) == (1, channel["id"]):
                return time_ns, self._decoded(channel, content[13:])

    @staticmethod
    def _decoded(channel: dict[str, Any], payload: bytes) -> Any:
        if channel["encoding"] == "json":
            return json.loads(payload)
        schema = Schema(base64.b64decode(channel["schema"]))
        return schema.decode(f".{channel['schemaName']}", payload)


@pytest.fixture(scope="module")
def config() -> RigConfig:
    rig = load_rig(Path(__file__).parents[4] / "config" / "sim.toml")
    cup = ObjectTable(name="cup", serial="LHR-1", shape="cylinder", size_m=(0.07, 0.1))
    bridges = Bridges(foxglove=Foxglove(enabled=True, port=0))
    return msgspec.structs.replace(rig, bridges=bridges, object=[cup])


def vector(told: dict[str, float]) -> list[float]:
    # A field of 0 does not travel.
    return [told.get(axis, 0.0) for axis in "xyz"]


async def test_foxglove_reads_scenes_and_our_own_messages(running, sending, config):
    async with running("bridge", serve, config, instance="foxglove") as (service, bus):
        hands = bus.publisher(topics.POSE, hand="right")
        cups = bus.publisher(topics.OBJECT, object="cup")
        numbers = iter(range(1, 10**6))

        def send() -> None:
            seq = next(numbers)
            hands.put(msgspec.structs.replace(POSE, seq=seq))
            cups.put(msgspec.structs.replace(CUP, seq=seq))

        while "port" not in service.values:
            await asyncio.sleep(0.01)
        address = f"ws://127.0.0.1:{int(service.values['port'])}"
        with sending(send):
            for _ in range(2):  # who goes may come again
                async with connect(address, subprotocols=["foxglove.sdk.v1"]) as connection:
                    client = await Client.of(connection)
                    assert {topic: one["schemaName"] for topic, one in client.channels.items()} == {
                        "/tf": "foxglove.FrameTransforms",
                        "/hands": "foxglove.SceneUpdate",
                        "/objects": "foxglove.SceneUpdate",
                        "/hand/right/joints": "foxglove.PosesInFrame",
                        "/rhot/hand/right/pose": "rhot.HandPose",
                        "/rhot/object/cup/pose": "rhot.ObjectPose",
                        "/rhot/object/cup/contacts": "rhot.ObjectContacts",
                    }
                    time_ns, joints = await client.first("/hand/right/joints")
                    told = {topic: (await client.first(topic))[1] for topic in FIRST}
    assert time_ns == STAMP_NS
    check_joints(joints)
    check_told(told)


def check_joints(joints: dict[str, Any]) -> None:
    assert joints["frame_id"] == "rig"
    assert len(joints["poses"]) == 26
    tip = joints["poses"][JOINT_INDEX["index_tip"]]
    assert vector(tip["position"]) == list(POSE.joint("index_tip").position_m)
    q = tip["orientation"]
    assert [q["w"], *vector(q)] == list(POSE.joint("index_tip").orientation_wxyz)


def check_told(told: dict[str, Any]) -> None:
    frames = {one["child_frame_id"]: one for one in told["/tf"]["transforms"]}
    assert set(frames) <= {"right_hand", "object_cup"}
    for one in frames.values():
        assert one["parent_frame_id"] == "rig"
        assert one["timestamp"]["seconds"] * 10**9 + one["timestamp"]["nanos"] == STAMP_NS
    (hand,) = told["/hands"]["entities"]
    assert (hand["id"], hand["frame_id"]) == ("right_hand", "rig")
    drawn = np.array([vector(ball["pose"]["position"]) for ball in hand["spheres"]])
    np.testing.assert_array_equal(drawn, POSE.positions_m)
    assert hand["spheres"][0]["size"]["x"] == 2.0 * POSE.joints[0].radius_m
    assert len(hand["lines"][0]["points"]) == 2 * 24
    (cup,) = told["/objects"]["entities"]
    assert (cup["frame_id"], cup["frame_locked"]) == ("object_cup", True)
    (tube,) = cup["cylinders"]
    assert vector(tube["size"]) == [0.07, 0.07, 0.1]
    pose = msgspec.convert(told["/rhot/hand/right/pose"], HandPose)
    assert pose.joints == POSE.joints


def test_it_is_for_this_machine_alone():
    context = foxglove.Context()
    with (
        pytest.raises(ConfigError, match="no password"),
        foxglove_service.server("0.0.0.0", 0, context),
    ):
        pass
    with (
        foxglove_service.server("127.0.0.1", 0, context) as port,
        pytest.raises(BusError, match="set another port"),
        foxglove_service.server("127.0.0.1", port, foxglove.Context()),
    ):
        pass
