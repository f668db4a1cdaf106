from __future__ import annotations

import asyncio

import rhot
from rhot import topics
from rhot.bus.bus import open_bus
from rhot.messages import HandPoints, Session

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
