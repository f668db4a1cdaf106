"""The master's clock, followed over a real router while somebody sets this machine's."""

from __future__ import annotations

import asyncio

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.bus.master_clock import follow_master
from rhot.clock import OffsetEstimator
from rhot.messages import ClockEcho


class SetClock:
    """A clock that somebody may set."""

    def __init__(self) -> None:
        self.ahead_ns = 0

    def now_ns(self) -> int:
        return clock.now_ns() + self.ahead_ns


async def test_a_clock_that_is_set_is_followed_before_the_next_exchange_is_due(router):
    """On either side; the offset is the own clock minus the master's."""
    own, master, estimator = SetClock(), SetClock(), OffsetEstimator()

    async def reads(offset_ns: int) -> None:
        while abs(estimator.at(own.now_ns()).offset_ns - offset_ns) > 50_000_000:
            await asyncio.sleep(0.01)

    async with (
        asyncio.timeout(60.0),
        open_bus("desk", [router]) as theirs,
        open_bus("desk", [router]) as ours,
    ):
        theirs.answer(topics.CLOCK, lambda: ClockEcho(master_ns=master.now_ns()))
        following = asyncio.create_task(follow_master(ours, estimator, own.now_ns))
        while estimator.at(own.now_ns()).sigma_ns < 0:
            await asyncio.sleep(0.01)
        for clock_set, step_ns, sign in ((own, 2 * 10**9, 1), (master, 5 * 10**8, -1)):
            before_ns = estimator.at(own.now_ns()).offset_ns
            clock_set.ahead_ns += step_ns
            await reads(before_ns + sign * step_ns)
        following.cancel()
