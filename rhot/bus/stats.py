"""Counters and latencies of one stream, for a service's health. Pure: time is an argument.

Counts are reset by each beat; a stream that carries nothing reports zeros, and -1 for latencies
nobody measured.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Literal

from rhot.messages.health import StreamHealth
from rhot.topics import Topic

Direction = Literal["in", "out"]
# A beat of 1 s at 1 kHz keeps every second latency; more would cost more than the percentiles are
# worth.
_LATENCIES = 512


@dataclass
class StreamStats:
    """What a publisher or subscription counts between two beats."""

    topic: Topic
    key: str
    names: dict[str, str]
    direction: Direction
    count: int = 0
    dropped: int = 0
    rejected: int = 0
    # Since the start; dropped counts anew with each beat.
    dropped_before: int = 0
    latencies_ns: deque[int] = field(default_factory=lambda: deque(maxlen=_LATENCIES))

    @property
    def dropped_in_all(self) -> int:
        """Messages dropped since the start."""
        return self.dropped_before + self.dropped

    def beat(self, elapsed_s: float, expected_hz: float) -> StreamHealth:
        """Health since the last beat, elapsed_s ago; starts counting anew."""
        rate_hz = self.count / elapsed_s if elapsed_s > 0.0 else 0.0
        p50_ms, p99_ms = percentiles_ms(self.latencies_ns)
        health = StreamHealth(
            key=self.key,
            direction=self.direction,
            count=self.count,
            rate_hz=round(rate_hz, 2),
            expected_hz=round(expected_hz, 2),
            # 0.8: one frame lost in five is where a user should look; scheduling jitter stays
            # within it.
            ok=expected_hz <= 0.0 or rate_hz >= 0.8 * expected_hz,
            dropped=self.dropped,
            rejected=self.rejected,
            latency_p50_ms=p50_ms,
            latency_p99_ms=p99_ms,
        )
        self.dropped_before += self.dropped
        self.count = self.dropped = self.rejected = 0
        self.latencies_ns.clear()
        return health


def percentiles_ms(latencies_ns: deque[int] | list[int]) -> tuple[float, float]:
    """(p50, p99) in ms by nearest rank; (-1, -1) of nothing."""
    if not latencies_ns:
        return -1.0, -1.0
    ordered = sorted(latencies_ns)
    last = len(ordered) - 1
    p50, p99 = (round(ordered[min(last, round(q * last))] * 1e-6, 3) for q in (0.5, 0.99))
    return p50, p99
