"""The bridge on a real router, heard by python-osc's own server."""

from __future__ import annotations

import asyncio
import contextlib

import pytest
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_server import AsyncIOOSCUDPServer

from rhot import topics
from rhot.files.bridge_tables import Bridges, Vmc
from rhot.files.config import RigConfig
from services.bridges.service import serve
from services.bridges.vmc.skeleton import finger_bones
from testing.sample_hands import object_pose, random_pose


@contextlib.asynccontextmanager
async def osc_server(port: int = 0):
    """(port, messages): what a program with VMC hears."""
    heard: list[tuple] = []
    dispatcher = Dispatcher()
    dispatcher.set_default_handler(lambda address, *values: heard.append((address, *values)))
    server = AsyncIOOSCUDPServer(("127.0.0.1", port), dispatcher, asyncio.get_running_loop())
    transport, _ = await server.create_serve_endpoint()
    try:
        yield transport.get_extra_info("sockname")[1], heard
    finally:
        transport.close()
        await asyncio.sleep(0)


async def until(condition):
    while not condition():
        await asyncio.sleep(0.01)


def bones(heard):
    return {name: values for address, name, *values in heard if address.endswith("Bone/Pos")}


async def test_a_program_hears_hands_and_objects_and_may_come_and_go(running, sending):
    async with osc_server() as (port, _):
        pass
    config = RigConfig(bridges=Bridges(vmc=Vmc(enabled=True, port=port)))
    async with running("bridge", serve, config, instance="vmc") as (service, bus):
        # Nobody listens at first.
        await until(lambda: service.status.startswith("nobody listens"))
        pose, cup = random_pose("left", 3), object_pose("cup")
        hands = bus.publisher(topics.POSE, hand="left")
        cups = bus.publisher(topics.OBJECT, object="cup")
        for _ in range(2):
            async with osc_server(port) as (_, heard):
                with sending(lambda: (hands.put(pose), cups.put(cup))):
                    await until(lambda: ("/VMC/Ext/OK", 1) in heard and len(bones(heard)) == 15)
                    await until(
                        lambda: any(one[:2] == ("/VMC/Ext/Tra/Pos", "cup") for one in heard)
                    )
                assert service.status == f"sending to 127.0.0.1:{port}"
                for bone in finger_bones(pose):
                    values = bones(heard)[bone.name]
                    assert values == pytest.approx(
                        [*bone.position_m, *bone.rotation_xyzw], abs=1e-6
                    )
                times = [one[1] for one in heard if one[0] == "/VMC/Ext/T"]
                assert times == sorted(times)
                assert ("/VMC/Ext/Tra/Pos", "left_wrist") in {one[:2] for one in heard}
                # The hand is lost: it is said, and none of its bones is sent any more.
                await until(lambda: heard[-2:-1] == [("/VMC/Ext/OK", 0)])
                heard.clear()
                await until(lambda: len(heard) >= 4)
                assert {one[0] for one in heard} == {"/VMC/Ext/OK", "/VMC/Ext/T"}
            await until(lambda: service.status.startswith("nobody listens"))
