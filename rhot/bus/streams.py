"""The two ends of a stream: publishers and the buffers between Zenoh's threads and the event loop.

Used through rhot.bus.bus.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections import deque
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import msgspec
import zenoh

from rhot import clock
from rhot.bus.stats import StreamStats
from rhot.errors import BusError
from rhot.topics import ALIVE, Priority, Topic

T = TypeVar("T")
S = TypeVar("S")
Payload = bytes | bytearray | str

# Consecutive messages a consumer gets without giving the event loop to others.
_BURST = 32
# Keys of which `latest()` remembers the newest message: keys come from the network, memory must
# not.
_MAX_KEYS = 256

_PRIORITY = {
    Priority.REAL_TIME: zenoh.Priority.REAL_TIME,
    Priority.DATA: zenoh.Priority.DATA,
    Priority.BACKGROUND: zenoh.Priority.BACKGROUND,
}


@dataclass(frozen=True)
class Sample:
    """One undecoded sample; received_ns is CLOCK_REALTIME in Zenoh's thread."""

    key: str
    payload: bytes
    attachment: bytes
    received_ns: int


class Publisher(Generic[T]):
    """Sends one stream; never blocks: what the network cannot take is dropped."""

    def __init__(
        self, session: zenoh.Session, topic: Topic[T], key: str, stats: StreamStats
    ) -> None:
        self.key = key
        self._stats = stats
        self._encoder = msgspec.json.Encoder()
        self._message = topic.message
        self._publisher = session.declare_publisher(
            key,
            encoding=topic.encoding,
            # Blocking live data stalls everything behind it (measured: 5 s); late poses are worth
            # nothing.
            congestion_control=zenoh.CongestionControl.DROP,
            priority=_PRIORITY[topic.priority],
            express=topic.priority is Priority.REAL_TIME,
        )

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes."""
        return bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined] # the stub says bool

    def put(self, message: T) -> None:
        """Send a message, with sent_ns filled in.

        A value that is not finite has no JSON: such a message is not sent, and counted as rejected.
        """
        now_ns = clock.now_ns()
        if hasattr(message, "sent_ns"):
            message = msgspec.structs.replace(message, sent_ns=now_ns)  # type: ignore[type-var]
        payload = self._encoder.encode(message)
        if b"null" in payload and not self._decodes(payload):
            self._stats.rejected += 1
            return
        stamp_ns = getattr(message, "stamp_ns", 0)
        self._count(now_ns - stamp_ns if stamp_ns else None)
        self._publisher.put(payload)

    def _decodes(self, payload: bytes) -> bool:
        try:
            msgspec.json.decode(payload, type=self._message)
        except msgspec.DecodeError:
            return False
        return True

    def put_bytes(self, payload: Payload, attachment: msgspec.Struct | None = None) -> None:
        """Send bytes on a topic without a message type, with a message as attachment."""
        self._count(None)
        self._publisher.put(
            payload, attachment=None if attachment is None else self._encoder.encode(attachment)
        )

    def _count(self, latency_ns: int | None) -> None:
        self._stats.count += 1
        if latency_ns is not None:
            self._stats.latencies_ns.append(latency_ns)

    def undeclare(self) -> None:
        self._publisher.undeclare()


class _Buffer(Generic[S]):
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
        self._entity: Any = None

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


class RawSubscription(_Buffer[Sample]):
    """Undecoded samples of a key expression."""

    def __init__(
        self, loop: asyncio.AbstractEventLoop, stats: StreamStats, capacity: int | None
    ) -> None:
        super().__init__(loop, capacity)
        self.stats = stats

    def declare(self, session: zenoh.Session, key: str) -> None:
        self._entity = session.declare_subscriber(key, self._on_sample)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        received_ns = clock.now_ns()
        if len(sample.payload) > self.stats.topic.max_bytes:
            self.stats.rejected += 1
            return
        attachment = b"" if sample.attachment is None else sample.attachment.to_bytes()
        key = str(sample.key_expr)
        self.stats.dropped += self.push(
            key, Sample(key, sample.payload.to_bytes(), attachment, received_ns)
        )

    def __aiter__(self) -> RawSubscription:
        return self

    async def __anext__(self) -> Sample:
        sample = await self.take()
        self.stats.count += 1
        return sample


class Subscription(Generic[T]):
    """Decoded messages of one topic: `async for message in subscription`."""

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        topic: Topic[T],
        stats: StreamStats,
        capacity: int | None,
    ) -> None:
        if topic.message is None:
            raise BusError(
                f"topic {topic.template} carries {topic.media_type}, no message; use raw()"
            )
        self.stats = stats
        self._topic = topic
        self._raw = RawSubscription(loop, stats, capacity)
        self._decoder = msgspec.json.Decoder(topic.message)

    def declare(self, session: zenoh.Session, key: str) -> None:
        self._raw.declare(session, key)

    def __aiter__(self) -> Subscription[T]:
        return self

    async def __anext__(self) -> T:
        while True:
            sample = await self._raw.take()
            message = self._decode(sample)
            if message is None:
                self.stats.rejected += 1
                continue
            self.stats.count += 1
            sent_ns = getattr(message, "sent_ns", 0)
            if sent_ns:
                self.stats.latencies_ns.append(sample.received_ns - sent_ns)
            return message

    def _decode(self, sample: Sample) -> T | None:
        try:
            message = self._decoder.decode(sample.payload)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
            return None
        # A message that says another name than its key would be taken for another sender's.
        names = self._topic.names(sample.key) or {}
        if any(getattr(message, field, value) != value for field, value in names.items()):
            return None
        return message

    def undeclare(self) -> None:
        self._raw.undeclare()


@dataclass(frozen=True)
class Alive:
    """A service that came or went."""

    service: str
    instance: str
    alive: bool


class AliveWatch(_Buffer[Alive]):
    """Liveliness tokens as they come and go."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__(loop, 1024)

    def declare(self, session: zenoh.Session, key: str) -> None:
        self._entity = session.liveliness().declare_subscriber(key, self._on_sample, history=True)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        names = ALIVE.names(key)
        if names is not None:
            self.push(
                key, Alive(names["service"], names["instance"], sample.kind == zenoh.SampleKind.PUT)
            )

    def __aiter__(self) -> AliveWatch:
        return self

    async def __anext__(self) -> Alive:
        return await self.take()
