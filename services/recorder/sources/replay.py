"""Replays a recording: publishes every payload on its key again, at the recorded times.

Keys are rewritten to the rig of the bus; payloads and their stamps stay as they were, so that
subscribers compute the same again. Messages on keys that are not in the topics table, or cannot be
published on, are skipped. Files that are not complete recordings raise CaptureError.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, CaptureError
from services.recorder.reader import Record, read

# A longer gap is a pause of the recording, or a damaged time: it is shortened to this.
_LONGEST_GAP_NS = 10_000_000_000
# Messages that are late are sent in bursts of so many before the event loop gets its turn; larger
# bursts overflow Zenoh's queues.
_BURST = 16


async def replay(
    bus: Bus,
    path: Path,
    rate: float = 1.0,
    *,
    loop: bool = False,
    only: Collection[str] = (),
    report: Callable[[Record], None] | None = None,
) -> int:
    """Publish a recording; returns how many messages were sent.

    rate 1 is real time, 2 twice as fast, 0 as fast as possible. loop begins again at the end, for
    ever. only keeps the named topics (`camera/markers`; empty: all). report is called with each
    record as it is sent.
    """
    if not (math.isfinite(rate) and rate >= 0.0):
        raise CaptureError(
            f"cannot replay at rate {rate}; 1 is real time, 2 twice as fast, 0 as fast as possible"
        )
    check_names(only)
    sent = 0
    while True:
        before = sent
        sent += await _replay_once(bus, path, rate, only, report)
        if not loop:
            return sent
        if sent == before:
            raise CaptureError(f"{path}: has nothing to replay in a loop")


def check_names(only: Collection[str]) -> None:
    """Raises CaptureError for names that are not those of recorded topics."""
    valid = sorted(topic.name for topic in topics.TOPICS if topic.recorded)
    unknown = sorted(set(only) - set(valid))
    if unknown:
        raise CaptureError(f"no recorded topic is called {unknown[0]!r}; valid: {', '.join(valid)}")


async def _replay_once(
    bus: Bus,
    path: Path,
    rate: float,
    only: Collection[str],
    report: Callable[[Record], None] | None,
) -> int:
    clock = asyncio.get_running_loop()
    due_s, last_ns, sent = clock.time(), None, 0
    routes: dict[str, Route | None] = {}
    for record in read(path):
        if record.key not in routes:
            routes[record.key] = _route(record.key, bus.rig, only)
        route = routes[record.key]
        if route is None:
            continue
        if rate > 0.0:
            gap_ns = 0 if last_ns is None else record.log_time_ns - last_ns
            due_s += min(max(gap_ns, 0), _LONGEST_GAP_NS) * 1e-9 / rate
        last_ns = record.log_time_ns
        if due_s > clock.time() or sent % _BURST == 0:
            await asyncio.sleep(max(0.0, due_s - clock.time()))
        if 0.0 < rate <= 1.0:
            bus.put_raw(route.key, record.payload, route.encoding)
        else:
            # Perhaps faster than a busy router forwards: nothing is lost, and nothing else waits.
            await asyncio.to_thread(
                bus.put_raw, route.key, record.payload, route.encoding, wait=True
            )
        sent += 1
        if report is not None:
            report(record)
    return sent


@dataclass(frozen=True)
class Route:
    """Where messages of one recorded key go."""

    key: str
    encoding: str


def _route(recorded_key: str, rig: str, only: Collection[str]) -> Route | None:
    topic = topics.find(recorded_key)
    if topic is None or not topic.recorded or (only and topic.name not in only):
        return None
    try:
        return Route(topic.key(rig, **(topic.names(recorded_key) or {})), topic.encoding)
    except BusError:
        # A key that is not valid, e.g. with a wildcard: it was recorded as it came, but cannot be
        # published again.
        return None
