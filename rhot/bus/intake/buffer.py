"""A bounded buffer between Zenoh's threads and the event loop, with one wake-up per filling.

A full buffer drops its oldest item, and says how many it dropped; a closed one ends the iteration.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from rhot.errors import BusError

S = TypeVar("S")

# Consecutive messages a consumer gets without giving the event loop to others.
_BURST = 32
# Keys whose newest message `latest()` remembers: keys come from the network, memory must not.
_MAX_KEYS = 256
# What waits in one buffer, together: 512 samples of the largest message would be 32 MB for each of
# a recorder's topics. A single item may be larger (a picture).
MAX_BYTES = 8 << 20


class Undeclarable(Protocol):
    """A Zenoh entity that can be ended."""

    def undeclare(self) -> None: ...


class Buffer(Generic[S]):
    """A bounded buffer filled by Zenoh's threads and emptied by the event loop, with one wake-up
    per filling.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        capacity: int | None,
        size_of: Callable[[S], int] = lambda _: 0,
    ) -> None:
        """size_of tells the bytes that an item keeps, where items may be large."""
        if capacity is not None and capacity < 1:
            raise BusError(f"a queue of {capacity} holds nothing; it must be at least 1")
        self._loop = loop
        self._capacity = capacity
        self._size_of = size_of
        self._lock = threading.Lock()
        self._queue: deque[S] = deque()
        self._newest: dict[str, S] = {}
        self._bytes = 0
        self._woken = False
        self._closed = False
        self._waiter: asyncio.Future[None] | None = None
        self._burst = 0
        self._consume: Callable[[S], None] | None = None
        self._entity: Undeclarable | None = None

    @property
    def waiting(self) -> int:
        """How many items wait."""
        return len(self._queue) + len(self._newest)

    @property
    def waiting_bytes(self) -> int:
        """Size of all that waits."""
        return self._bytes

    def push(self, key: str, item: S) -> int:
        """Add an item from any thread; how many were dropped for it, or 1 if it was itself."""
        with self._lock:
            dropped = self._push_locked(key, item)
            wake, self._woken = not self._woken, True
        if wake:
            # Not contextlib.suppress, which is three calls more for every message.
            try:
                self._loop.call_soon_threadsafe(self.wake)
            except RuntimeError:  # the loop has closed; nobody reads any more
                return dropped
        return dropped

    def add(self, key: str, item: S) -> int:
        """As push, from the event loop, which wake() then tells."""
        with self._lock:
            return self._push_locked(key, item)

    def _push_locked(self, key: str, item: S) -> int:
        size = self._size_of(item)
        dropped = 0
        if self._capacity is None:
            if key in self._newest:
                # In its place in the order: a busy key must not wait behind each new one.
                self._bytes += size - self._size_of(self._newest[key])
                self._newest[key] = item
                return 1
            if len(self._newest) >= _MAX_KEYS or (self._newest and self._bytes + size > MAX_BYTES):
                return 1
            self._newest[key] = item
        else:
            while self._queue and (
                len(self._queue) >= self._capacity or self._bytes + size > MAX_BYTES
            ):
                self._bytes -= self._size_of(self._queue.popleft())
                dropped += 1
            self._queue.append(item)
        self._bytes += size
        return dropped

    def _pop(self) -> S | None:
        with self._lock:
            if self._queue:
                item = self._queue.popleft()
            elif self._newest:
                item = self._newest.pop(next(iter(self._newest)))
            else:
                self._woken = False
                return None
            self._bytes -= self._size_of(item)
            return item

    def wake(self) -> None:
        """Hand over what waits, or wake who waits for it; in the event loop."""
        if self._consume is not None:
            self._consume_some()
        elif self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def _consume_some(self) -> None:
        for _ in range(_BURST):
            if self._consume is None or (item := self._pop()) is None:
                return
            self._consume(item)
        # More may wait; others' turn first.
        self._loop.call_soon(self.wake)

    async def each(self, consume: Callable[[S], None]) -> None:
        """Call consume with every item, in the event loop, until closed; what it raises is raised.

        As a loop over take(), without waking a task for each item.
        """
        self._waiter = ended = self._loop.create_future()

        def take(item: S) -> None:
            try:
                consume(item)
            except Exception as error:
                self._consume = None
                if not ended.done():
                    ended.set_exception(error)

        self._consume = take
        try:
            self.wake()
            await ended
        finally:
            self._consume = None

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
        self._closed, self._consume = True, None
        self.wake()
        if self._entity is not None:
            self._entity.undeclare()
            self._entity = None
