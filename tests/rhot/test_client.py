from __future__ import annotations

import asyncio

import pytest

import rhot
from rhot import topics
from rhot.bus.bus import open_bus
from rhot.messages import HandPoints, Session
from rhot.messages.objects import ObjectPose

DEADLINE_S = 10.0


async def test_five_lines_are_enough(router):
    async with open_bus("desk", [router]) as master, rhot.connect(router) as rig:
        publisher = master.publisher(topics.POINTS, hand="right")

        async def send():
            while True:
                publisher.put(HandPoints(hand="right", seq=4, stamp_ns=1, points=[]))
                await asyncio.sleep(0.01)

        task = asyncio.create_task(send())
        async with asyncio.timeout(DEADLINE_S):
            async for points in rig.hand_points("right"):
                assert points.seq == 4
                break
        task.cancel()


async def test_session_is_asked_for_and_set(router):
    async with open_bus("desk", [router]) as master, rhot.connect(router, rig="desk") as rig:
        heard = master.every(topics.SESSION, 4)
        master.answer(topics.SESSION, lambda: Session(running=True, start_ns=7))
        async with asyncio.timeout(DEADLINE_S):
            while (session := await rig.session()) is None:
                pass
            assert session.start_ns == 7
            rig.stop()
            assert not (await anext(heard)).running


async def test_no_master_no_session(router):
    async with rhot.connect(router) as rig:
        assert await rig.session() is None


async def test_an_object_at_the_instant_of_something_else(router):
    at_ns = 10**18

    def pose(ms):
        return ObjectPose(
            object="cup",
            serial="LHR-1",
            seq=ms,
            stamp_ns=at_ns + ms * 1_000_000,
            position_m=(ms * 1e-3, 0.0, 0.5),
            orientation_wxyz=(1.0, 0.0, 0.0, 0.0),
            velocity_m_s=(1.0, 0.0, 0.0),
            angular_velocity_rad_s=(0.0, 0.0, 0.0),
            tracking="ok",
            registered=True,
        )

    async with open_bus("desk", [router]) as tracker, rhot.connect(router) as rig:
        publisher = tracker.publisher(topics.OBJECT, object="cup")
        assert await rig.object_at("cup", at_ns, timeout_s=0.05) is None
        async with asyncio.timeout(DEADLINE_S):
            while not publisher.wanted:
                await asyncio.sleep(0.01)
            publisher.put(pose(0))
            publisher.put(pose(20))
            while (inside := await rig.object_at("cup", at_ns + 15_000_000)) is None:
                await asyncio.sleep(0.01)
            while (ahead := await rig.object_at("cup", at_ns + 50_000_000)) is None:
                await asyncio.sleep(0.01)
        assert inside.position_m[0] == pytest.approx(0.015)
        assert ahead.position_m[0] == pytest.approx(0.050)
        assert await rig.object_at("cup", at_ns + 200_000_000) is None
