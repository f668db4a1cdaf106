"""What a bus promises over its life: queries, clocks, who is alive, routers that go and come."""

from __future__ import annotations

import asyncio

import pytest
import zenoh

from rhot import clock, topics
from rhot.bus.bus import open_bus, router_config
from rhot.errors import BusError
from rhot.messages import ClockEcho, HandPoints, Session
from testing.waiting import DEADLINE_S, next_of, publisher_of


def points(seq: int) -> HandPoints:
    return HandPoints(hand="right", seq=seq, stamp_ns=clock.now_ns(), points=[])


async def test_queries_are_answered_by_functions_and_coroutines(pair):
    sender, receiver = pair

    async def picture():
        await asyncio.sleep(0)
        return b"png"

    def broken():
        raise ValueError("no session")

    sender.answer(topics.SESSION, lambda: Session(running=True, start_ns=5))
    sender.answer(topics.FRAME, picture, camera="left")
    sender.answer(topics.FRAME, broken, camera="right")
    async with asyncio.timeout(DEADLINE_S):
        while not await receiver.get(topics.SESSION, timeout_s=0.5):
            pass
    assert await receiver.get(topics.SESSION) == [Session(running=True, start_ns=5)]
    assert await receiver.get(topics.FRAME, camera="left") == [b"png"]
    assert await receiver.get(topics.FRAME, camera="right") == []
    assert await receiver.get(topics.FRAME, timeout_s=0.2, camera="nobody") == []


async def test_echo_reads_the_callers_clock(pair):
    sender, receiver = pair
    sender.answer(topics.CLOCK, lambda: ClockEcho(master_ns=clock.now_ns()))
    exchanges = []
    async with asyncio.timeout(DEADLINE_S):
        while not exchanges:
            exchanges = await receiver.echoes(lambda: clock.now_ns() + 1_000_000_000)
    asked_ns, master_ns, answered_ns = exchanges[0].stamps
    assert asked_ns <= answered_ns
    assert abs((asked_ns + answered_ns) / 2 - master_ns - 1e9) <= (answered_ns - asked_ns) / 2 + 1e6


async def test_liveliness_tells_who_is_there_who_comes_and_who_goes(router):
    async with open_bus("test", [router]) as watcher:
        async with open_bus("test", [router]) as service:
            service.alive("fusion", "main")
            watch = watcher.watch_alive()
            (there,) = await next_of(watch, 1)
            assert (there.service, there.instance, there.alive) == ("fusion", "main", True)
        (gone,) = await next_of(watch, 1)
        assert not gone.alive


async def test_survives_the_routers_death_and_return(endpoint):
    router = zenoh.open(router_config([endpoint]))
    async with open_bus("test", [endpoint]) as sender, open_bus("test", [endpoint]) as receiver:
        subscription = receiver.every(topics.POINTS, 1024)
        receiver.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
        publisher = await publisher_of(sender, topics.POINTS, hand="right")
        await asyncio.to_thread(router.close)
        publisher.put(points(1))  # neither raises nor blocks
        router = await asyncio.to_thread(zenoh.open, router_config([endpoint]))

        async def pump():
            while True:
                publisher.put(points(2))
                await asyncio.sleep(0.01)

        task = asyncio.create_task(pump())
        assert (await next_of(subscription, 1))[0].seq in (1, 2)
        task.cancel()
        async with asyncio.timeout(DEADLINE_S):
            while not await sender.get(topics.SESSION, timeout_s=0.5):
                pass
    await asyncio.to_thread(router.close)


async def test_open_waits_for_the_router_and_can_be_cancelled(endpoint):
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.5), open_bus("test", [endpoint]):
            pytest.fail("there is no router")

    async def enter():
        async with open_bus("test", [endpoint]) as bus:
            return bus.rig

    task = asyncio.create_task(enter())
    router = await asyncio.to_thread(zenoh.open, router_config([endpoint]))
    async with asyncio.timeout(DEADLINE_S):
        assert await task == "test"
    await asyncio.to_thread(router.close)


async def test_iterations_end_with_the_bus(router):
    async with open_bus("test", [router]) as bus:
        subscription = bus.every(topics.POINTS, 4)
        task = asyncio.create_task(_collect(subscription))
        await asyncio.sleep(0)
    async with asyncio.timeout(DEADLINE_S):
        assert await task == []


async def _collect(subscription):
    return [message async for message in subscription]


async def test_misuse_is_refused(pair):
    sender, receiver = pair
    with pytest.raises(BusError, match="cannot publish on the pattern"):
        sender.publisher(topics.POINTS)
    with pytest.raises(BusError, match="use raw"):
        receiver.every(topics.PREVIEW, 4)
    with pytest.raises(BusError, match="holds nothing"):
        receiver.every(topics.POINTS, 0)
    with pytest.raises(BusError, match="is no address of a router"):
        async with open_bus("test", ["nonsense"]):
            pass
