"""Services of one process: messages handed over as they are, and to everybody else as ever."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.intake.rounds import Rounds
from rhot.errors import BusError
from rhot.messages import HandPoint, HandPoints
from testing.waiting import next_of, until

# Longer than a message takes through the router.
_LATER_S = 0.3


@pytest.fixture(params=["called back", "in rounds"])
async def services(router: str, request: pytest.FixtureRequest) -> AsyncIterator[tuple[Bus, Bus]]:
    """Two services over one session."""
    rounds = Rounds() if request.param == "in rounds" else None
    async with open_bus("test", [router], rounds=rounds) as bus:
        beside = bus.beside()
        yield bus, beside


@pytest.fixture
async def stranger(router: str) -> AsyncIterator[Bus]:
    """Another process's bus."""
    async with open_bus("test", [router]) as bus:
        yield bus


def points(seq: int) -> HandPoints:
    return HandPoints(hand="right", seq=seq, stamp_ns=5, points=[point_at((0.1, 0.2, 0.3))])


def point_at(position_m: tuple[float, float, float]) -> HandPoint:
    return HandPoint(
        name="index_tip",
        position_m=position_m,
        sigma_m=(1e-3, 1e-3, 1e-3),
        cameras=["left", "right"],
        source="measured",
    )


async def test_a_message_is_the_same_object_once_and_in_order(services):
    fusion, solver = services
    heard = solver.every(topics.POINTS, 8, hand="right")
    publisher = fusion.publisher(topics.POINTS, hand="right")
    sent = [points(seq) for seq in range(5)]
    for message in sent:
        publisher.put(message)
    received = await next_of(heard, 5)
    assert [message.seq for message in received] == [0, 1, 2, 3, 4]
    assert all(got.points is told.points for got, told in zip(received, sent, strict=True))
    assert all(message.sent_ns > 0 for message in received)
    await asyncio.sleep(_LATER_S)
    assert heard.waiting == 0
    assert (heard.stats.count, heard.stats.dropped, heard.stats.rejected) == (5, 0, 0)
    assert len(heard.stats.latencies_ns) == 5


async def test_others_hear_it_and_are_heard(services, stranger):
    fusion, solver = services
    heard, elsewhere = (bus.every(topics.POINTS, 8) for bus in (solver, stranger))
    publisher = fusion.publisher(topics.POINTS, hand="right")
    from_elsewhere = stranger.publisher(topics.POINTS, hand="left")
    # Until the router has told the one of the other: both may come more than once.
    await until(lambda: elsewhere.waiting > 0, lambda: publisher.put(points(1)))
    left = HandPoints(hand="left", seq=2, stamp_ns=5, points=[])
    seen: set[str] = set()

    async def hear() -> None:
        async for message in heard:
            seen.add(message.hand)

    listening = asyncio.create_task(hear())
    await until(lambda: seen == {"left", "right"}, lambda: from_elsewhere.put(left))
    listening.cancel()
    assert (await anext(elsewhere)).points == points(1).points


async def test_only_the_newest_counts_where_only_that_is_wanted(services):
    fusion, solver = services
    heard = solver.latest(topics.POINTS)
    publisher = fusion.publisher(topics.POINTS, hand="right")
    for seq in range(5):
        publisher.put(points(seq))
    assert (await anext(heard)).seq == 4
    assert heard.stats.dropped == 4


async def test_a_patient_reader_is_woken_later(services):
    fusion, solver = services
    heard: list[HandPoints] = []
    subscription = solver.latest(topics.POINTS)
    subscription.patience_s = _LATER_S
    listening = asyncio.create_task(subscription.each(heard.append))
    publisher = fusion.publisher(topics.POINTS, hand="right")
    await asyncio.sleep(0)
    began_s = asyncio.get_running_loop().time()
    publisher.put(points(3))
    await until(lambda: heard)
    assert asyncio.get_running_loop().time() - began_s >= 0.9 * _LATER_S
    assert [message.seq for message in heard] == [3]
    listening.cancel()


async def test_undecoded_samples_of_the_same_session_go_through_zenoh(services):
    fusion, solver = services
    heard = solver.raw(topics.POINTS, 8)
    fusion.publisher(topics.POINTS, hand="right").put(points(7))
    (sample,) = await next_of(heard, 1)
    assert b'"seq":7' in sample.payload


async def test_what_is_not_finite_is_handed_to_nobody(services):
    fusion, solver = services
    heard = solver.every(topics.POINTS, 8, hand="right")
    publisher = fusion.publisher(topics.POINTS, hand="right")
    wrong = point_at((float("nan"), 0.0, 0.0))
    publisher.put(HandPoints(hand="right", seq=1, stamp_ns=5, points=[wrong]))
    assert (heard.waiting, publisher.stats.rejected) == (0, 1)


async def test_a_closed_subscription_hears_no_more(services):
    fusion, solver = services
    closed, heard = (solver.every(topics.POINTS, 8) for _ in range(2))
    publisher = fusion.publisher(topics.POINTS, hand="right")
    publisher.put(points(1))
    solver.close(closed)
    publisher.put(points(2))
    assert [message.seq for message in await next_of(heard, 2)] == [1, 2]
    assert closed.waiting == 1


async def test_too_late_for_another_service_says_so(router):
    async with open_bus("test", [router]) as bus:
        bus.publisher(topics.POINTS, hand="right")
        with pytest.raises(BusError, match="streams already"):
            bus.beside()
