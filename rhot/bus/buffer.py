"""A bounded buffer between Zenoh's threads and the event loop, with one wake-up per filling.

A full buffer drops its oldest item, and says how many it dropped; a closed one ends the iteration.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections import deque
from typing import Generic, Protocol, TypeVar

from rhot.errors import BusError

S = TypeVar("S")

# Consecutive messages a consumer gets without giving the event loop to others.
_BURST = 32
# Keys whose newest message `latest()` remembers: keys come from the network, memory must not.
_MAX_KEYS = 256


class Undeclarable(Protocol):
    """A Zenoh entity that can be ended."""

    def undeclare(self) -> None: ...


class Buffer(Generic[S]):
    """A bounded buffer filled by Zenoh's threads and emptied by the event loop, with one wake-up
    per filling.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, capacity: int | None) -> None:
        if capacity is not None and capacity < 1:
            raise BusError(f"a queue of {capacity} holds nothing; it must be at least 1")
        self._loop = loop
        self._capacity = capacity
        self._lock = threading.Lock()
        self._queue: deque[S] = deque()
        self._newest: dict[str, S] = {}
        self._woken = False
        self._closed = False
        self._waiter: asyncio.Future[None] | None = None
        self._burst = 0
        self._entity: Undeclarable | None = None

    def push(self, key: str, item: S) -> int:
        """Add an item from any thread; how many were dropped for it."""
        with self._lock:
            dropped = self._push_locked(key, item)
            wake, self._woken = not self._woken, True
        if wake:
            with contextlib.suppress(RuntimeError):  # the loop has closed; nobody reads any more
                self._loop.call_soon_threadsafe(self._wake)
        return dropped

    def _push_locked(self, key: str, item: S) -> int:
        if self._capacity is None:
            dropped = int(key in self._newest)
            if not dropped and len(self._newest) >= _MAX_KEYS:
                return 1
            self._newest[key] = item
            return dropped
        dropped = int(len(self._queue) >= self._capacity)
        if dropped:
            self._queue.popleft()
        self._queue.append(item)
        return dropped

    def _pop(self) -> S | None:
        with self._lock:
            if self._queue:
                return self._queue.popleft()
            if self._newest:
                return self._newest.pop(next(iter(self._newest)))
            self._woken = False
            return None

    def _wake(self) -> None:
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    async def take(self) -> S:
        """The next item; raises StopAsyncIteration once closed."""
        self._burst += 1
        if self._burst > _BURST:
            self._burst = 0
            await asyncio.sleep(0)
        while (item := self._pop()) is None:
            if self._closed:
                raise StopAsyncIteration
            self._burst = 0
            self._waiter = self._loop.create_future()
            await self._waiter
        return item

    def undeclare(self) -> None:
        """End the subscription and every iteration over it."""
        self._closed = True
        self._wake()
        if self._entity is not None:
            self._entity.undeclare()
            self._entity = None
