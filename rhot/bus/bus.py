"""asyncio over Zenoh: typed publishers, subscriptions that name their contract, queries,
liveliness.

Zenoh calls back in its own threads. Each subscription copies the payload there, puts it into a
bounded buffer and wakes the event loop once, however many samples arrive meanwhile: the lowest
latency measured (210 us direct, 390 us through a router) and no way for a slow consumer to stall
another subscription. (With many rigs a process asks instead: intake/rounds.py.) What does not fit
is dropped, oldest first, and counted; what does not decode is rejected and counted, never raised:
every message is untrusted.

Late: a consumer sees at most its buffer's worth of old samples. Missing: nothing arrives, nothing
raises; after the router's death sessions reconnect by themselves, and what was sent meanwhile is
lost. No router yet: open_bus waits for it.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from typing import Any, TypeVar

import msgspec
import zenoh

from rhot import topics
from rhot.bus.clock_exchange import ClockExchange, exchanges
from rhot.bus.connecting import connected
from rhot.bus.handover import Handover
from rhot.bus.intake.rounds import Rounds
from rhot.bus.intake.standing_queue import StandingQueue
from rhot.bus.liveliness import Alive, AliveWatch
from rhot.bus.publisher import Payload, Publisher
from rhot.bus.queries import (
    Answerer,
    Asker,
    Handler,
    RequestHandler,
    Tasks,
    decoded,
    only_answer,
)
from rhot.bus.stats import Direction, StreamStats
from rhot.bus.subscription import RawSubscription, Sample, Subscription
from rhot.bus.zenoh_config import client_config, router_config
from rhot.errors import BusError
from rhot.topics import Kind, Topic

T = TypeVar("T")
Listener = TypeVar("Listener", Subscription[Any], RawSubscription)
log = logging.getLogger("rhot.bus")

__all__ = [
    "Alive",
    "Bus",
    "Publisher",
    "Sample",
    "Subscription",
    "client_config",
    "open_bus",
    "router_config",
]

# A session that does not close in this time belongs to a wedged link: the process goes on.
_CLOSE_S = 3.0


@contextlib.asynccontextmanager
async def open_bus(
    rig: str,
    connect: Sequence[str],
    *,
    despite_certificates: bool = True,
    rounds: Rounds | None = None,
) -> AsyncIterator[Bus]:
    """A session with the router at `connect`; waits for the router as long as it takes, and is
    cancellable.

    rig is the name in every key; "*" listens to all rigs (and cannot publish). A certificate that
    keeps the session from opening is a line in the log at once, and waited for like the router: it
    may be renewed. Without despite_certificates it raises BusError. rounds, which rigs of a process
    share: messages are asked for in these.
    """
    session = await connected(connect, despite_certificates)
    bus = Bus(rig, session, rounds)
    try:
        yield bus
    finally:
        bus.stop()
        with contextlib.suppress(TimeoutError, zenoh.ZError):
            # Shielded: a session that a second cancellation leaves open keeps the process alive.
            await asyncio.shield(asyncio.wait_for(asyncio.to_thread(session.close), _CLOSE_S))


class Bus:
    """One rig's keys over one Zenoh session, for the event loop that made it."""

    def __init__(
        self,
        rig: str,
        session: zenoh.Session,
        rounds: Rounds | None = None,
        handover: Handover | None = None,
    ) -> None:
        self.rig, self._session, self._rounds = rig, session, rounds
        self.streams: list[StreamStats] = []
        self.session = str(session.zid())  # as the router lists it
        self._loop = asyncio.get_running_loop()
        self._asker = Asker(session, self._loop)
        self._open: list[Any] = []
        self._tasks = Tasks(self._loop)
        self._beside: list[Bus] = []
        self._handover = handover  # between the services of this process, if there are several

    def beside(self) -> Bus:
        """A bus of its own over the same session, for another service of this process, to which
        messages are handed over. It ends with this one. BusError if this one has streams already.
        """
        if self._open:
            raise BusError(f"the bus of rig {self.rig} has streams already: too late for another")
        self._handover = self._handover or Handover()
        other = Bus(self.rig, self._session, self._rounds, self._handover)
        self._beside.append(other)
        return other

    @property
    def routers(self) -> list[str]:
        """Ids of the routers at the other end now; a lost one is noticed within two seconds."""
        return sorted(str(zid) for zid in self._session.info.routers_zid())

    def publisher(self, topic: Topic[T], **names: str) -> Publisher[T]:
        """A publisher of one stream; its name fields must all be given."""
        key = topic.key(self.rig, **names)
        if "*" in key:
            raise BusError(
                f"cannot publish on the pattern {key}; give {list(topic.fields)} and the rig's name"
            )
        stats = self._stats(topic, names, "out")
        publisher = Publisher(self._session, topic, key, stats, self._handover)
        self._open.append(publisher)
        return publisher

    def latest(self, topic: Topic[T], **names: str) -> Subscription[T]:
        """Only the newest message of each key counts: for displays and control, which may skip."""
        return self._subscribe(topic, None, names)

    def every(
        self, topic: Topic[T], n: int, expected: Iterable[str] = (), **names: str
    ) -> Subscription[T]:
        """Every message, in order, through a queue of n that drops the oldest.

        expected: names that the rig has, of the open field; of others only some a second are taken.
        """
        return self._subscribe(topic, n, names, self._keys(topic, expected, names))

    def in_time(
        self, topic: Topic[T], n: int, expected: Iterable[str] = (), **names: str
    ) -> Subscription[T]:
        """As every(), but who cannot keep up skips what has waited (intake/standing_queue.py)."""
        keys = self._keys(topic, expected, names)
        return self._subscribe(topic, n, names, keys, StandingQueue())

    def _keys(
        self, topic: Topic[Any], expected: Iterable[str], names: dict[str, str]
    ) -> frozenset[str]:
        """The keys of the expected names, in the field that is left open."""
        (open_field,) = set(topic.fields) - set(names) if expected else ("",)
        return frozenset(topic.key(self.rig, **names, **{open_field: name}) for name in expected)

    def raw(self, topic: Topic[T], n: int, **names: str) -> RawSubscription:
        """Undecoded samples through a queue of n that drops the oldest."""
        stats = self._stats(topic, names, "in")
        return self._declared(RawSubscription(self._loop, stats, n))

    def others(self, topic: Topic[T], n: int, **names: str) -> RawSubscription:
        """As raw(), of what other sessions publish alone; it is no stream of health."""
        stats = StreamStats(topic, topic.key(self.rig, **names), names, "in")
        return self._declared(RawSubscription(self._loop, stats, n), zenoh.Locality.REMOTE)

    def _subscribe(
        self,
        topic: Topic[T],
        n: int | None,
        names: dict[str, str],
        expected: frozenset[str] = frozenset(),
        standing: StandingQueue | None = None,
    ) -> Subscription[T]:
        stats = self._stats(topic, names, "in")
        one = Subscription(self._loop, topic, stats, n, expected, standing, self._handover)
        return self._declared(one)

    def _declared(self, one: Listener, origin: zenoh.Locality = zenoh.Locality.ANY) -> Listener:
        """A subscription to its own key, from now on and until the session ends."""
        one.declare(self._session, origin, self._rounds)
        self._open.append(one)
        return one

    def _stats(self, topic: Topic[Any], names: dict[str, str], direction: Direction) -> StreamStats:
        stats = StreamStats(topic, topic.key(self.rig, **names), names, direction)
        if topic.kind is Kind.STREAM:
            self.streams.append(stats)
        return stats

    async def get(
        self,
        topic: Topic[T],
        timeout_s: float = 1.0,
        request: msgspec.Struct | None = None,
        **names: str,
    ) -> list[T]:
        """All answers to a query, decoded; those that do not decode, and refusals, are left out.

        Empty after timeout_s without any.
        """
        key = topic.key(self.rig, **names)
        return decoded(topic, await self._asker.replies(topic, key, timeout_s, request))

    async def request(
        self, topic: Topic[T], request: msgspec.Struct, timeout_s: float = 5.0, **names: str
    ) -> T:
        """Ask one service for something, and return its answer.

        Raises RefusedError with the service's own reason if it refuses, BusError if nobody answers
        within timeout_s.
        """
        key = topic.key(self.rig, **names)
        return only_answer(topic, key, await self._asker.replies(topic, key, timeout_s, request))

    async def echoes(
        self, now_ns: Callable[[], int], timeout_s: float = 1.0
    ) -> list[ClockExchange]:
        """One exchange with the clock of the master, or of each that takes itself for one.

        Both own stamps are read from now_ns as close to the wire as Python gets.
        """
        asked_ns = now_ns()
        key = topics.CLOCK.key(self.rig)
        replies = await self._asker.replies(
            topics.CLOCK, key, timeout_s, now_ns=now_ns, all_of_one_key=True
        )
        return exchanges(asked_ns, replies)

    def answer(self, topic: Topic[Any], handler: Handler, **names: str) -> None:
        """Answer queries for the rest of the session.

        A plain function runs in Zenoh's thread (quick and thread-safe); a coroutine function runs
        on the event loop. It returns a message, bytes, or None for no answer; what it raises goes
        to the asker as a Refusal.
        """
        answerer = Answerer(topic, topic.key(self.rig, **names), self._tasks.start)
        self._open.append(answerer.declare(self._session, answerer.plain(handler)))

    def answer_requests(self, topic: Topic[Any], handler: RequestHandler, **names: str) -> None:
        """As answer(), with a coroutine function that takes the request's payload.

        The payload is empty for a plain question. A request larger than max_bytes gets no answer.
        """
        answerer = Answerer(topic, topic.key(self.rig, **names), self._tasks.start)
        self._open.append(answerer.declare(self._session, answerer.with_request(handler)))

    def alive(self, service: str, instance: str) -> None:
        """Declare this service alive until the session ends."""
        key = topics.ALIVE.key(self.rig, service=service, instance=instance)
        self._open.append(self._session.liveliness().declare_token(key))

    def watch_alive(self) -> AliveWatch:
        """Services coming and going, beginning with those that are there."""
        watch = AliveWatch(self._loop)
        watch.declare(self._session, topics.ALIVE.key(self.rig))
        self._open.append(watch)
        return watch

    def put_raw(
        self, key: str, payload: Payload, encoding: str = "application/json", *, wait: bool = False
    ) -> None:
        """Publish bytes on a full key, for replay.

        A line that is full loses them, as live data. With wait it is waited for, up to 5 s: call it
        in a thread.
        """
        full = zenoh.CongestionControl.BLOCK if wait else zenoh.CongestionControl.DROP
        # Express: else Zenoh gathers messages for a millisecond.
        self._session.put(key, payload, encoding=encoding, congestion_control=full, express=True)

    def close(self, one: Subscription[Any] | RawSubscription | AliveWatch | Publisher[Any]) -> None:
        """End one of them before the session ends; its stream leaves health."""
        one.undeclare()
        self._open = [entity for entity in self._open if entity is not one]
        self.streams[:] = [s for s in self.streams if s is not getattr(one, "stats", None)]

    def stop(self) -> None:
        """Undeclare everything and end every iteration over it."""
        for other in self._beside:
            other.stop()
        self._tasks.cancel()
        for entity in self._open:
            with contextlib.suppress(zenoh.ZError):
                entity.undeclare()
        self._open.clear()
