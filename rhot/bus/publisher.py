"""The sending end of a stream. Never blocks: what the network cannot take is dropped."""

from __future__ import annotations

from typing import Generic, TypeVar

import msgspec
import zenoh

from rhot import clock
from rhot.bus.handover import Handover
from rhot.bus.stats import StreamStats
from rhot.topics import Priority, Topic

T = TypeVar("T")
Payload = bytes | bytearray | str

_PRIORITY = {
    Priority.REAL_TIME: zenoh.Priority.REAL_TIME,
    Priority.DATA: zenoh.Priority.DATA,
    Priority.BACKGROUND: zenoh.Priority.BACKGROUND,
}


class Publisher(Generic[T]):
    """Sends one stream; never blocks: what the network cannot take is dropped."""

    def __init__(
        self,
        session: zenoh.Session,
        topic: Topic[T],
        key: str,
        stats: StreamStats,
        handover: Handover | None = None,
    ) -> None:
        """handover: to readers of this process, where there are several services in it."""
        self.key = key
        self.stats = stats
        self._handover = handover
        self._encoder = msgspec.json.Encoder()
        self._message = topic.message
        self._says_when = "sent_ns" in getattr(topic.message, "__struct_fields__", ())
        self._publisher = session.declare_publisher(
            key,
            encoding=topic.encoding,
            # Blocking live data stalls everything behind it (measured: 5 s); late poses are worth
            # nothing.
            congestion_control=zenoh.CongestionControl.DROP,
            priority=_PRIORITY[topic.priority],
            express=topic.express and topic.priority is Priority.REAL_TIME,
        )

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes."""
        # Zenoh's stub says bool.
        return bool(self._publisher.matching_status.matching)  # type: ignore[attr-defined]

    def put(self, message: T) -> None:
        """Send a message, with sent_ns filled in.

        A value that is not finite has no JSON: such a message is not sent, and counted as rejected.
        Where there are several services in the process, to be called in the event loop.
        """
        now_ns = clock.now_ns()
        if self._says_when:
            message = msgspec.structs.replace(message, sent_ns=now_ns)  # type: ignore[type-var]
        payload = self._encoder.encode(message)
        if b"null" in payload and not self._decodes(payload):
            self.stats.rejected += 1
            return
        self._publisher.put(payload)
        if self._handover is not None:
            for reader in self._handover.readers(self.key):
                reader.hand_over(self.key, message, now_ns)
        stamp_ns = getattr(message, "stamp_ns", 0)
        self._count(now_ns - stamp_ns if stamp_ns else None)

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
        self.stats.count += 1
        if latency_ns is not None:
            self.stats.latencies_ns.append(latency_ns)

    def undeclare(self) -> None:
        self._publisher.undeclare()
