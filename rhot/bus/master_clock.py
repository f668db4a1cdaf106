"""Asks the master for its clock over the bus, for the estimate of rhot/clock.py."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from rhot.bus.bus import Bus
from rhot.clock import OffsetEstimator


async def follow_master(bus: Bus, estimator: OffsetEstimator, own_ns: Callable[[], int]) -> None:
    """Keep an estimator fed for ever: eight exchanges for a quick start, then one a second."""
    exchanges = 0
    while True:
        exchange = await bus.echo(own_ns)
        if exchange is not None:
            estimator.update(*exchange)
            exchanges += 1
        await asyncio.sleep(0.05 if exchange is not None and exchanges < 8 else 1.0)
