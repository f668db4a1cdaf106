"""Asks the master for its clock over the bus, for the estimate of rhot/clock.py.

A clock that is set here shows at once beside CLOCK_MONOTONIC, which nobody sets: the estimate is
moved along. One that is set on the master shows as an exchange that contradicts the estimate: a few
quick ones decide.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable

from rhot.bus.bus import Bus
from rhot.bus.clock_exchange import MasterChoice, several_masters
from rhot.clock import OffsetEstimator

# What is wrong with the rig's masters, or None while all is well.
Tell = Callable[[str | None], None]

# An estimate from so many quick exchanges is as good as the window's minimum delay gets at once.
_QUICK = 8
_QUICK_S, _PERIOD_S, _LOOK_S = 0.05, 1.0, 0.1
# NTP turns a clock by 0.05 ms between two looks; smaller steps are left to the exchanges.
_STEP_NS = 2_000_000
# A thread that is interrupted between reading two clocks sees a step that was none.
_READINGS = 4


async def follow_master(
    bus: Bus, estimator: OffsetEstimator, own_ns: Callable[[], int], tell: Tell | None = None
) -> None:
    """Keep an estimator fed for ever: eight exchanges for a quick start, then one a second.

    Where more than one master answers, the one that was first is followed until it is gone; tell
    hears of it after each exchange.
    """
    exchanges, choice = 0, MasterChoice()
    while True:
        answers = await bus.echoes(own_ns)
        chosen = choice.choose(answers)
        if chosen is not None:
            estimator.update(*chosen.stamps)
            exchanges += 1
        if tell is not None and answers:
            tell(several_masters(answers))
        if chosen is not None and (exchanges < _QUICK or estimator.doubted):
            await asyncio.sleep(_QUICK_S)
        elif (step_ns := await _step_ns(own_ns)) != 0:
            estimator.follow_step(step_ns)


async def watch_masters(
    bus: Bus, own_ns: Callable[[], int], tell: Tell, pause: Callable[[], Awaitable[None]]
) -> None:
    """For the master itself: ask who else answers for its clock, for ever, a pause apart."""
    while True:
        tell(several_masters(await bus.echoes(own_ns)))
        await pause()


async def _step_ns(own_ns: Callable[[], int]) -> int:
    """Wait for the next exchange to be due; if the clock is set meanwhile, by how much, at once."""
    before_ns = _ahead_ns(own_ns)
    for _ in range(round(_PERIOD_S / _LOOK_S)):
        await asyncio.sleep(_LOOK_S)
        step_ns = _ahead_ns(own_ns) - before_ns
        if abs(step_ns) > _STEP_NS:
            return step_ns
    return 0


def _ahead_ns(own_ns: Callable[[], int]) -> int:
    """The own clock minus CLOCK_MONOTONIC, from the quickest of some readings."""
    readings = []
    for _ in range(_READINGS):
        before_ns = time.monotonic_ns()
        own = own_ns()
        after_ns = time.monotonic_ns()
        readings.append((after_ns - before_ns, own - (before_ns + after_ns) // 2))
    return min(readings)[1]
