"""Waiting on conditions with a deadline: what tests of asynchronous things do in place of sleeping.

On a machine that does many things at once everything takes a multiple of its time.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import TypeVar

from rhot.bus.bus import Bus, Publisher
from rhot.topics import Topic

T = TypeVar("T")
DEADLINE_S = 60.0


async def until(
    condition: Callable[[], T],
    act: Callable[[], object] = lambda: None,
    deadline_s: float = DEADLINE_S,
) -> T:
    """What the condition says once it is true, acting again and again until then.

    Raises TimeoutError.
    """
    async with asyncio.timeout(deadline_s):
        while not (found := condition()):
            act()
            await asyncio.sleep(0.01)
    return found


async def next_of(messages: AsyncIterator[T], count: int) -> list[T]:
    """The next messages of a subscription; raises TimeoutError."""
    async with asyncio.timeout(DEADLINE_S):
        return [await anext(messages) for _ in range(count)]


async def publisher_of(bus: Bus, topic: Topic[T], **names: str) -> Publisher[T]:
    """A publisher that somebody already listens to."""
    publisher = bus.publisher(topic, **names)
    await until(lambda: publisher.wanted)
    return publisher
