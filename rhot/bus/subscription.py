"""The receiving end of a stream: undecoded samples, or decoded messages of one topic.

What does not decode, or names another sender than its key, is rejected and counted, never raised.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import msgspec
import zenoh

from rhot import clock
from rhot.bus.handover import Handover
from rhot.bus.intake.buffer import Buffer
from rhot.bus.intake.rounds import Rounds
from rhot.bus.intake.standing_queue import StandingQueue
from rhot.bus.stats import StreamStats
from rhot.errors import UNDECODABLE, BusError
from rhot.topics import Topic

T = TypeVar("T")


# Of a sample without its content: the objects, and its key.
_SAMPLE_BYTES = 512
# What goes with a picture is a small message; larger ones are rejected unread, as payloads are.
_MAX_ATTACHMENT_BYTES = 65_536
# Of names that a rig does not have: enough to be named as a fault, too few to be in the way.
_STRANGERS_A_SECOND = 16
# Samples that wait for the next round where they are asked for: two seconds of a rig's cameras.
# More than that in one round is a flood, whose oldest are lost uncounted.
_RING = 256
# What a JSON object may begin with, white space of people who type one included.
_BEGINS_OBJECT = (b"{", b" ", b"\t", b"\r", b"\n")
# Keys that one subscription knows by heart: a rig has some dozens.
_MAX_KEYS = 256


class Sample(NamedTuple):
    """One undecoded sample; received_ns is CLOCK_REALTIME in Zenoh's thread, or about the middle
    between two rounds. message: what a service of this process hands over to a typed subscription,
    without a payload; raw() gives none.
    """

    key: str
    payload: bytes
    attachment: bytes
    received_ns: int
    message: Any = None


def _size_of(sample: Sample) -> int:
    return len(sample.payload) + len(sample.attachment) + _SAMPLE_BYTES


class RawSubscription(Buffer[Sample]):
    """Undecoded samples of a key expression.

    With objects_only what cannot be a JSON object is rejected before it takes a message's place in
    the queue, and of keys that are not among the expected ones (if any are) only some a second are
    taken: among 10^5 messages of garbage, or of ever new names, those that count were lost
    otherwise.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        stats: StreamStats,
        capacity: int | None,
        *,
        objects_only: bool = False,
        expected: frozenset[str] = frozenset(),
    ) -> None:
        super().__init__(loop, capacity, _size_of)
        self.stats = stats
        self._objects_only = objects_only
        self._expected = expected
        # The second it is, and how many of other keys it had.
        self._second, self._strangers = 0, 0
        # Where samples are asked for.
        self._rounds: Rounds | None = None

    def declare(
        self, session: zenoh.Session, origin: zenoh.Locality, rounds: Rounds | None = None
    ) -> None:
        """Receive from now on: called back, or asked for in rounds."""
        key = self.stats.key
        if rounds is None:
            self._entity = session.declare_subscriber(key, self._on_sample, allowed_origin=origin)
            return
        ring: Any = zenoh.handlers.RingChannel(_RING)
        subscriber: Any = session.declare_subscriber(key, ring, allowed_origin=origin)
        self._entity, self._rounds = subscriber, rounds
        rounds.join(self, subscriber.try_recv)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        """Take a sample in Zenoh's thread."""
        taken = self._admitted(sample, clock.now_ns())
        if taken is not None:
            self._note_dropped(self.push(taken.key, taken))

    def take_in(self, sample: zenoh.Sample, came_ns: int) -> None:
        """Take a sample in the event loop, as if it had come at came_ns; wake() hands it over."""
        taken = self._admitted(sample, came_ns)
        if taken is not None:
            self._note_dropped(self.add(taken.key, taken))

    def hand_over(self, sample: Sample, patience_s: float) -> None:
        """Take a message of this process, in the event loop; its reader is woken so much later."""
        self._note_dropped(self.add(sample.key, sample))
        self._loop.call_later(patience_s, self.wake)

    def _note_dropped(self, dropped: int) -> None:
        if dropped:
            self.stats.dropped += dropped

    def _admitted(self, sample: zenoh.Sample, received_ns: int) -> Sample | None:
        """What of a sample goes into the queue; None, counted, if it is to have no place there."""
        # Zenoh makes each of these anew whenever it is asked for one.
        payload, attached, key = sample.payload, sample.attachment, str(sample.key_expr)
        too_much = attached is not None and len(attached) > _MAX_ATTACHMENT_BYTES
        if len(payload) > self.stats.topic.max_bytes or too_much:
            self.stats.rejected += 1
            return None
        if self._expected and key not in self._expected and not self._admits_stranger(received_ns):
            self.stats.dropped += 1
            return None
        content = payload.to_bytes()
        if self._objects_only and content[:1] not in _BEGINS_OBJECT:
            self.stats.rejected += 1
            return None
        attachment = b"" if attached is None else attached.to_bytes()
        return Sample(key, content, attachment, received_ns)

    def _admits_stranger(self, now_ns: int) -> bool:
        if now_ns // 10**9 != self._second:
            self._second, self._strangers = now_ns // 10**9, 0
        self._strangers += 1
        return self._strangers <= _STRANGERS_A_SECOND

    def undeclare(self) -> None:
        if self._rounds is not None:
            self._rounds.leave(self)
            self._rounds = None
        super().undeclare()

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
        expected: frozenset[str] = frozenset(),
        standing: StandingQueue | None = None,
        handover: Handover | None = None,
    ) -> None:
        """standing: for a reader who is to answer in time rather than everything; handover: from
        publishers of this process, where there are several services in it.
        """
        if topic.message is None:
            raise BusError(
                f"topic {topic.template} carries {topic.media_type}, no message; use raw()"
            )
        self.stats = stats
        # How long the last message had waited for its reader; told to one who is to be in time.
        self.waited_s = 0.0
        # So long may wait what is handed over, where the loop has better to do.
        self.patience_s = 0.0
        self._topic = topic
        self._standing = standing
        self._handover = handover
        self._raw = RawSubscription(loop, stats, capacity, objects_only=True, expected=expected)
        self._decoder = msgspec.json.Decoder(topic.message)
        # What a key says that its messages say as well: worked out once a key, not once a message.
        self._said: dict[str, tuple[tuple[str, str], ...]] = {}

    def declare(
        self, session: zenoh.Session, origin: zenoh.Locality, rounds: Rounds | None = None
    ) -> None:
        if self._handover is not None:
            self._handover.join(self)
            origin = zenoh.Locality.REMOTE
        self._raw.declare(session, origin, rounds)

    @property
    def key(self) -> str:
        """The key expression it reads."""
        return self.stats.key

    def hand_over(self, key: str, message: T, now_ns: int) -> None:
        """Take a message of this process, as it is; in the event loop."""
        self._raw.hand_over(Sample(key, b"", b"", now_ns, message), self.patience_s)

    @property
    def waiting(self) -> int:
        """How many samples have come and are not taken yet."""
        return self._raw.waiting

    def __aiter__(self) -> Subscription[T]:
        return self

    async def __anext__(self) -> T:
        while True:
            message = self._message_of(await self._raw.take())
            if message is not None:
                return message

    async def each(self, consume: Callable[[T], None]) -> None:
        """Call consume with every message, in the event loop, until the subscription ends.

        As `async for`, a task's wake-up sooner: for what a pose waits for. What consume raises is
        raised here.
        """

        def take(sample: Sample) -> None:
            message = self._message_of(sample)
            if message is not None:
                consume(message)

        await self._raw.each(take)

    def _message_of(self, sample: Sample) -> T | None:
        """A sample decoded, and counted; None if it is no message, or has waited for too long."""
        if self._standing is not None:
            now_ns = clock.now_ns()
            self.waited_s = (now_ns - sample.received_ns) * 1e-9
            if self._standing.skips(self.waited_s, now_ns * 1e-9):
                self.stats.dropped += 1
                return None
        message = self._decode(sample) if sample.message is None else sample.message
        if message is None:
            self.stats.rejected += 1
            return None
        self.stats.count += 1
        sent_ns = getattr(message, "sent_ns", 0)
        if sent_ns:
            self.stats.latencies_ns.append(sample.received_ns - sent_ns)
        return message

    def _decode(self, sample: Sample) -> T | None:
        try:
            message = self._decoder.decode(sample.payload)
        except UNDECODABLE:
            return None
        # A message that says another name than its key would be taken for another sender's.
        said = self._said.get(sample.key)
        if said is None:
            said = self._said_by(sample.key, message)
        for field, value in said:
            if getattr(message, field) != value:
                return None
        return message

    def _said_by(self, key: str, message: T) -> tuple[tuple[str, str], ...]:
        """The fields of a key that are fields of its messages, with their values."""
        names = self._topic.names(key) or {}
        said = tuple((field, value) for field, value in names.items() if hasattr(message, field))
        # Keys come from the network: what does not fit is worked out anew each time.
        if len(self._said) < _MAX_KEYS:
            self._said[key] = said
        return said

    def undeclare(self) -> None:
        if self._handover is not None:
            self._handover.leave(self)
        self._raw.undeclare()
