"""The bridge to ROS 2 on a rig's own router: its keys pass, to whom they may, and no others."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import msgspec
import numpy as np
import pytest
import zenoh
import zenoh.ext

from rhot.bus.bus import client_config
from rhot.bus.security.credentials import router_endpoints
from rhot.files.bridge_tables import Bridges, Ros2
from services.bridges.ros2.encode import static_transform, type_hash
from services.bridges.ros2.node import RosNode
from services.bridges.ros2.topics import TF_STATIC, all_topics
from services.cli.live.router import running_router
from testing.secured_rig import SecuredRig
from testing.waiting import until

DOMAIN = 3
# Long enough for an answer on a busy machine; none comes to what is forbidden.
QUIET_S = 0.5


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> SecuredRig:
    return SecuredRig(tmp_path_factory.mktemp("rig"))


@pytest.fixture
async def sessions(rig) -> AsyncIterator[dict[str, zenoh.Session]]:
    """A session for each of: the master's loopback, the laptop that looks on, a camera's Pi."""
    bridges = Bridges(ros2=Ros2(enabled=True, domain=DOMAIN))
    config = msgspec.structs.replace(rig.config, bridges=bridges)
    hosts = {"here": rig.open, "laptop": rig.as_host("laptop"), "left": rig.as_host("left")}
    async with running_router(router_endpoints(config), config):
        with contextlib.ExitStack() as stack:
            yield {
                name: stack.enter_context(
                    await asyncio.to_thread(zenoh.open, client_config(endpoints))
                )
                for name, endpoints in hosts.items()
            }


async def tokens(session: zenoh.Session) -> set[str]:
    replies = await asyncio.to_thread(session.liveliness().get, f"@ros2_lv/{DOMAIN}/**")
    return {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}


async def test_who_looks_on_sees_the_bridge_and_hears_it(sessions, rig):
    node = RosNode(sessions["here"], DOMAIN, "jazzy")
    publishers = {topic: node.publisher(topic) for topic in all_topics(rig.config)}
    static = static_transform(np.eye(4), 1)
    publishers[TF_STATIC].send(static)
    other = (
        sessions["here"].liveliness().declare_token(f"@ros2_lv/{DOMAIN}/abc/0/0/NN/%/%/somebody")
    )
    expected = 1 + len(publishers)
    async with asyncio.timeout(8.0):
        while len(await tokens(sessions["laptop"])) != expected:
            await asyncio.sleep(0.05)
    assert len(await tokens(sessions["here"])) == expected + 1
    assert await tokens(sessions["left"]) == set()
    told: dict[str, list[zenoh.Sample]] = {"laptop": [], "left": []}
    key = TF_STATIC.key(DOMAIN, type_hash(TF_STATIC, "jazzy"))
    kept = [
        zenoh.ext.declare_advanced_subscriber(
            sessions[name],
            key,
            heard.append,
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
        )
        for name, heard in told.items()
    ]
    # What was said before it came, and what is said now.
    await until(lambda: told["laptop"])
    publishers[TF_STATIC].send(static)
    await until(lambda: len(told["laptop"]) == 2)
    await asyncio.sleep(QUIET_S)
    assert told["left"] == []
    for subscriber in kept:
        subscriber.undeclare()
    other.undeclare()


async def test_who_looks_on_says_nothing_in_ros(sessions):
    heard: list[zenoh.Sample] = []
    subscriber = sessions["here"].declare_subscriber(f"{DOMAIN}/**", heard.append)
    pretended = (
        sessions["laptop"]
        .liveliness()
        .declare_token(f"@ros2_lv/{DOMAIN}/abc/0/0/NN/%/%/rhot_bridge")
    )
    for _ in range(20):
        sessions["laptop"].put(f"{DOMAIN}/tf/type/hash", b"x")
        await asyncio.sleep(0.02)
    assert await tokens(sessions["here"]) == set()
    assert heard == []
    pretended.undeclare()
    subscriber.undeclare()
