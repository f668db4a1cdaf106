"""A second master does not move anybody's clock, and is named."""

from __future__ import annotations

import asyncio
import re

import pytest

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.bus.master_clock import follow_master
from rhot.clock import OffsetEstimator
from rhot.messages import ClockEcho
from testing.waiting import until


def be_master(bus, ahead_ns: int, uptime_ns: int) -> None:
    bus.answer(
        topics.CLOCK,
        lambda: ClockEcho(
            master_ns=clock.now_ns() + ahead_ns,
            session=bus.session,
            host="here",
            uptime_ns=uptime_ns,
        ),
    )


async def test_the_first_is_followed_until_it_is_gone(router):
    told: list[str | None] = []
    estimator = OffsetEstimator()

    def offset_ms() -> float:
        return estimator.at(clock.now_ns()).offset_ns * 1e-6

    async with open_bus("test", [router]) as node, open_bus("test", [router]) as second:
        async with open_bus("test", [router]) as first:
            be_master(first, 0, 10**9)
            task = asyncio.create_task(follow_master(node, estimator, clock.now_ns, told.append))
            await until(lambda: told and estimator.at(clock.now_ns()).sigma_ns >= 0)
            assert told[-1] is None
            # A second ahead, and it says that it has been there for longer.
            be_master(second, 10**9, 10**12)
            await until(lambda: told[-1] is not None)
            assert "2 services" in told[-1]
            # As exact as an answer takes on its way, on a busy machine some milliseconds.
            (apart_ms,) = re.findall(r"differ by ([\d.]+) ms", told[-1])
            assert float(apart_ms) == pytest.approx(1000.0, abs=100.0)
            heard = len(told)
            await until(lambda: len(told) >= heard + 4)
            assert abs(offset_ms()) < 100.0
        # The first is gone: the rig goes on with the other one, which is alone now.
        await until(lambda: told[-1] is None)
        await until(lambda: abs(offset_ms() + 1000.0) < 100.0)
        task.cancel()
