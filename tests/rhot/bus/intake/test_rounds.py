"""Messages asked for in rounds, over a real router: what tests/contract/ does not ask of both."""

from __future__ import annotations

import asyncio

import pytest

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.bus.intake.rounds import Rounds
from rhot.messages import HandPoints
from testing.waiting import DEADLINE_S, publisher_of, until


def points(seq: int, hand: str = "right") -> HandPoints:
    return HandPoints(hand=hand, seq=seq, stamp_ns=clock.now_ns(), points=[])


@pytest.fixture
async def buses(router):
    """Who sends, and two rigs' sessions that share rounds."""
    rounds = Rounds()
    async with (
        open_bus("first", [router]) as sender,
        open_bus("second", [router]) as other,
        open_bus("first", [router], rounds=rounds) as first,
        open_bus("second", [router], rounds=rounds) as second,
    ):
        yield sender, other, first, second


async def test_what_a_slow_reader_leaves_is_dropped_oldest_first_and_counted(buses):
    sender, _, first, _ = buses
    subscription = first.every(topics.POINTS, 4, hand="right")
    publisher = await publisher_of(sender, topics.POINTS, hand="right")
    for seq in range(100):
        publisher.put(points(seq))
        await asyncio.sleep(0)
    await until(lambda: subscription.stats.dropped == 96)
    assert subscription.waiting == 4
    assert [(await anext(subscription)).seq for _ in range(4)] == [96, 97, 98, 99]


async def test_messages_of_all_rigs_come_in_order_and_are_stamped_about_when_they_came(buses):
    sender, other, first, second = buses
    heard, late_ns = {"first": [], "second": []}, []
    subscriptions = [bus.every(topics.POINTS, 256, hand="right") for bus in (first, second)]
    publishers = [await publisher_of(bus, topics.POINTS, hand="right") for bus in (sender, other)]
    raw = first.raw(topics.POINTS, 256, hand="left")
    left = await publisher_of(sender, topics.POINTS, hand="left")
    tasks = [
        asyncio.create_task(one.each(lambda message, name=name: heard[name].append(message.seq)))
        for name, one in zip(heard, subscriptions, strict=True)
    ]
    for seq in range(200):
        for publisher in publishers:
            publisher.put(points(seq))
        if seq % 10 == 0:
            put_ns = clock.now_ns()
            left.put(points(seq, "left"))
            async with asyncio.timeout(DEADLINE_S):
                late_ns.append((await anext(raw)).received_ns - put_ns)
    await until(lambda: all(len(seqs) == 200 for seqs in heard.values()))
    assert heard == {"first": list(range(200)), "second": list(range(200))}
    # The middle between two rounds may be before a message was put, by half of what a round takes.
    assert min(late_ns) > -0.5e9
    assert sorted(late_ns)[len(late_ns) // 2] < 0.2e9
    for task in tasks:
        task.cancel()


async def test_who_fails_or_leaves_or_loses_its_session_stops_no_other(buses, router):
    sender, other, first, second = buses
    failing = first.every(topics.POINTS, 64, hand="right")
    leaving = second.every(topics.POINTS, 64, hand="left")
    heard = []

    def fail(message):
        raise ValueError("of this reader alone")

    task = asyncio.create_task(failing.each(fail))
    staying = second.every(topics.POINTS, 64, hand="right")
    reading = asyncio.create_task(staying.each(lambda message: heard.append(message.seq)))
    to_first = await publisher_of(sender, topics.POINTS, hand="right")
    to_second = await publisher_of(other, topics.POINTS, hand="right")
    to_first.put(points(1))
    with pytest.raises(ValueError, match="of this reader alone"):
        await asyncio.wait_for(task, DEADLINE_S)
    second.close(leaving)
    # As when a link is given up: the session is gone, its subscriptions are not.
    await asyncio.to_thread(first._session.close)
    to_second.put(points(2))
    await until(lambda: heard)
    assert heard == [2]
    reading.cancel()


async def test_rounds_end_with_the_last_and_begin_again(router):
    rounds = Rounds()
    for _ in range(2):
        async with (
            open_bus("test", [router]) as sender,
            open_bus("test", [router], rounds=rounds) as bus,
        ):
            subscription = bus.every(topics.POINTS, 4, hand="right")
            publisher = await publisher_of(sender, topics.POINTS, hand="right")
            publisher.put(points(7))
            async with asyncio.timeout(DEADLINE_S):
                assert (await anext(subscription)).seq == 7
        await until(lambda: not rounds._running)


class Counted:
    """Who counts how often it is asked, and has something where `waiting` is set."""

    def __init__(self) -> None:
        self.asked, self.taken, self.waiting = 0, 0, False

    def ask(self) -> object | None:
        self.asked += 1
        if not self.waiting:
            return None
        self.waiting = False
        return object()

    def take_in(self, sample: object, came_ns: int) -> None:
        self.taken += 1

    def wake(self) -> None:
        """Nobody waits."""


async def test_who_hears_nothing_is_asked_now_and_then_until_it_hears_something():
    rounds, busy, idle = Rounds(), Counted(), Counted()
    for one in (busy, idle):
        rounds.join(one, one.ask)

    async def asked(seconds: float) -> tuple[int, int]:
        before = busy.asked, idle.asked
        end_s = asyncio.get_running_loop().time() + seconds
        while asyncio.get_running_loop().time() < end_s:
            busy.waiting = True
            await asyncio.sleep(0.001)
        return busy.asked - before[0], idle.asked - before[1]

    await asked(1.2)
    of_busy, of_idle = await asked(0.5)
    assert of_idle <= 26
    assert of_busy > 4 * of_idle > 0
    idle.waiting = True
    of_busy, of_idle = await asked(0.5)
    assert idle.taken == 1
    assert of_idle > 0.5 * of_busy
    for one in (busy, idle):
        rounds.leave(one)
    await until(lambda: not rounds._running)
