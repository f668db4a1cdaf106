"""The bridge with real clients: several, slow ones, hostile ones, ones that go and come."""

from __future__ import annotations

import asyncio
import json
import socket
from pathlib import Path
from typing import Any

import msgspec
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from rhot import topics
from rhot.errors import BusError
from rhot.files.bridge_tables import Bridges, WebSocket
from rhot.files.config import RigConfig, load_rig
from rhot.messages import HandPose, WristPose
from rhot.messages.objects import ObjectPose
from services.bridges.websocket.door import Door
from services.bridges.websocket.server import WebServer
from services.bridges.websocket.service import serve
from testing.sample_hands import object_pose, random_pose

FAR = WristPose(position_m=(1e300, 0.0, 0.0), orientation_wxyz=(0.0, 0.0, 0.0, 0.0))


@pytest.fixture
def config() -> RigConfig:
    rig = load_rig(Path(__file__).parents[4] / "config" / "sim.toml")
    return msgspec.structs.replace(rig, bridges=Bridges(websocket=WebSocket(enabled=True, port=0)))


async def port_of(service: Any) -> int:
    while "port" not in service.values:
        await asyncio.sleep(0.01)
    return int(service.values["port"])


async def next_of(client: Any, topic: str) -> dict[str, Any]:
    while True:
        said = json.loads(await client.recv())
        if said["topic"] == topic:
            return said["message"]


async def test_clients_get_what_they_ask_for(running, sending, config):
    pose, cup = random_pose("right", 1), object_pose("cup", stamp_ns=7)
    async with running("bridge", serve, config, instance="websocket") as (service, bus):
        hands = bus.publisher(topics.POSE, hand="right")
        cups = bus.publisher(topics.OBJECT, object="cup")
        address = f"ws://127.0.0.1:{await port_of(service)}"

        def send() -> None:
            hands.put(pose)
            cups.put(cup)

        with sending(send):
            async with connect(address) as one, connect(address) as other:
                assert json.loads(await one.recv())["topic"] == "hello"
                told = msgspec.convert(await next_of(one, "hand/right/pose"), HandPose)
                assert told.joints == pose.joints
                await other.send('{"subscribe":["object/*/pose"]}')
                await next_of(other, "subscribed")
                for _ in range(5):
                    said = json.loads(await other.recv())
                    assert said["topic"] == "object/cup/pose"
                assert msgspec.convert(said["message"], ObjectPose).stamp_ns == 7
            # All went: nothing is subscribed to any more. Who comes then is served as before.
            while service.values["clients"] or bus_topics(service):
                await asyncio.sleep(0.02)
            async with connect(address) as again:
                await next_of(again, "hand/right/pose")


def bus_topics(service: Any) -> list[str]:
    return [stats.topic.template for stats in service.bus.streams if stats.direction == "in"]


async def test_hostile_clients_close_their_own_connection_alone(running, sending, config):
    async with running("bridge", serve, config, instance="websocket") as (service, bus):
        hands = bus.publisher(topics.POSE, hand="right")
        port = await port_of(service)
        address = f"ws://127.0.0.1:{port}"
        with sending(lambda: hands.put(random_pose("right", 1))):
            async with connect(address) as good:
                await next_of(good, "hand/right/pose")
                for sent, code in (
                    ('{"subscribe":7}', 1007),
                    (b"\x00\xff" * 40, 1007),
                    ("x" * 100_000, 1009),
                ):
                    async with connect(address) as bad:
                        await bad.send(sent)
                        with pytest.raises(ConnectionClosed) as closed:
                            while True:
                                await bad.recv()
                        assert closed.value.rcvd is not None
                        assert closed.value.rcvd.code == code
                for origin, path in (("https://evil.example", "/"), (None, "/secret")):
                    with pytest.raises(InvalidStatus):
                        await connect(address + path, origin=origin)
                # On the bus: a hand that nobody can draw, and nobody gets.
                hands.put(msgspec.structs.replace(random_pose("right", 1), wrist=FAR))
                # What is no HTTP at all, and a handshake that never ends.
                for garbage in (b"\x16\x03\x01" + b"\xff" * 500, b"GET / HTTP/1.1\r\nHost: "):
                    with socket.create_connection(("127.0.0.1", port)) as raw:
                        raw.sendall(garbage)
                for _ in range(5):
                    told = await next_of(good, "hand/right/pose")
                    assert told["wrist"]["position_m"][0] != FAR.position_m[0]


async def test_who_is_slow_gets_fewer_and_the_newest():
    """The client's library does not read on, as a program that is busy elsewhere."""
    server = WebServer(Door("127.0.0.1", "", (), "bridges.websocket"), '{"topic":"hello"}', 240.0)
    filler = "x" * 20_000
    async with (
        server.listening("127.0.0.1", 0, "bridges.websocket") as port,
        connect(f"ws://127.0.0.1:{port}", max_queue=1) as slow,
    ):
        await slow.recv()
        for number in range(1, 401):
            server.put("a/b/c", f'{{"topic":"a/b/c","message":[{number},"{filler}"]}}')
            await asyncio.sleep(0.002)
        got = [0]
        while got[-1] != 400:
            got.append((await next_of(slow, "a/b/c"))[0])
        # Those underway when it stopped reading, what its own library had taken, and the newest.
        assert got == sorted(got)
        assert len(got) < 12


async def test_a_taken_port_says_what_to_do():
    server = WebServer(Door("127.0.0.1", "", (), "bridges.websocket"), "", 60.0)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(BusError, match=r"set another host or port under \[bridges.websocket\]"):
            async with server.listening("127.0.0.1", taken.getsockname()[1], "bridges.websocket"):
                pass
