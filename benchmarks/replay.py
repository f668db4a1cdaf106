"""How true a replay is to its recording: spacing of messages at 1x, speed flat out, what is lost.

    python benchmarks/replay.py [--seconds 20] [--json FILE]

A recording of a rig (two cameras, a hand, an object, eight services) is played through a router to
a subscriber, which notes when each message comes. Beside it the plain way: an event loop that
sleeps until a message is due and reads with mcap's own reader; and a thread that does nothing but
sleep until each is due: later than that this machine wakes nobody. Times are this machine's, and
are worse while it has other work; the ratio to the plain way holds.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import tempfile
import time
from collections.abc import Awaitable, Callable
from dataclasses import asdict, dataclass
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import uvloop
import zenoh
from mcap.reader import SeekingReader

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.zenoh_config import client_config, router_config
from services.recorder.reader import Record, read
from services.recorder.sources.replay import replay
from services.recorder.writer import RecordingWriter
from testing.loopback import free_endpoint

# What a rig sends: topic, names, Hz and bytes of a message.
STREAMS = (
    (topics.MARKERS, {"camera": "left"}, 30.0, 600),
    (topics.MARKERS, {"camera": "right"}, 30.0, 600),
    (topics.POINTS, {"hand": "right"}, 30.0, 900),
    (topics.POSE, {"hand": "right"}, 30.0, 6000),
    (topics.OPENVR, {"serial": "LHR-1"}, 120.0, 700),
    (topics.OBJECT, {"object": "cup"}, 120.0, 500),
    *((topics.HEALTH, {"service": f"s{i}", "instance": "main"}, 1.0, 3000) for i in range(8)),
)
# Arrivals jitter by so much.
_JITTER_S = 1e-3
# What a replay at 1x is to keep.
_WANTED_MS = 2.0
# A message that is not there so long after the last one is lost.
_LAST_S = 0.5

Play = Callable[[Bus, Path, float], Awaitable[object]]


@dataclass(frozen=True)
class Result:
    """One replay; spacing errors in ms, None flat out."""

    way: str
    rate: float
    sent: int
    lost: int
    in_order: bool
    messages_s: float
    median_ms: float | None
    p95_ms: float | None
    max_ms: float | None
    beyond: int | None = None  # spacings that are off by more than 2 ms


def write_recording(path: Path, seconds: float) -> None:
    """A recording whose every payload differs."""
    chance = random.Random(1)
    planned = [
        (int((k / hz + chance.uniform(0.0, _JITTER_S)) * 1e9), topic, names, size)
        for topic, names, hz, size in STREAMS
        for k in range(int(seconds * hz))
    ]
    with RecordingWriter(path, "bench") as writer:
        for number, (at_ns, topic, names, size) in enumerate(sorted(planned, key=lambda p: p[0])):
            noise = chance.randbytes(size // 4).hex()
            payload = f'{{"number": {number}, "noise": "{noise}"}}'.encode()
            writer.add(topic, topic.key("bench", **names), payload, 10**18 + at_ns)


async def ours(bus: Bus, path: Path, rate: float) -> None:
    """As `rhot replay` does."""
    await replay(bus, path, rate)


async def plain(bus: Bus, path: Path, rate: float) -> None:
    """An event loop that sleeps, and mcap's own reader."""
    loop, began_s, first_ns = asyncio.get_running_loop(), None, 0
    with path.open("rb") as file:
        for _, channel, message in SeekingReader(file).iter_messages():
            if began_s is None:
                began_s, first_ns = loop.time(), message.log_time
            due_s = began_s + (message.log_time - first_ns) * 1e-9 / rate if rate else loop.time()
            await asyncio.sleep(max(0.0, due_s - loop.time()))
            bus.put_raw(channel.topic, message.data)


def listen(endpoint: str, line: Connection) -> None:
    """A router and a subscriber, in a process of their own; sends what has come when asked."""
    arrived: list[tuple[int, bytes]] = []
    with (
        zenoh.open(router_config([endpoint])),
        zenoh.open(client_config([endpoint])) as session,
    ):
        session.declare_subscriber(
            "rhot/bench/**", lambda s: arrived.append((time.monotonic_ns(), s.payload.to_bytes()))
        )
        line.send("ready")
        while line.recv() == "take":
            before = -1
            while len(arrived) > before:
                before = len(arrived)
                time.sleep(_LAST_S)
            line.send(list(arrived))
            arrived.clear()


async def measure(
    way: str, play: Play, endpoint: str, line: Connection, path: Path, rate: float
) -> Result:
    """Play a recording once, and how long that takes."""
    async with open_bus("bench", [endpoint]) as bus:
        await asyncio.sleep(_LAST_S)
        began_s = time.monotonic()
        await play(bus, path, rate)
        took_s = time.monotonic() - began_s
    line.send("take")
    return compare(way, rate, took_s, list(read(path)), line.recv())


def compare(
    way: str, rate: float, took_s: float, recorded: list[Record], arrived: list[tuple[int, bytes]]
) -> Result:
    """What arrived, beside what was recorded."""
    payloads, got = [r.payload for r in recorded], [payload for _, payload in arrived]
    off_ms: list[float | None] = [None, None, None]
    beyond: int | None = None
    if rate and got == payloads:
        spaced = np.diff([r.log_time_ns for r in recorded]) / rate
        errors = np.abs(np.diff([at for at, _ in arrived]) - spaced) * 1e-6
        off_ms = [round(float(v), 3) for v in np.percentile(errors, [50, 95, 100])]
        beyond = int(np.count_nonzero(errors > _WANTED_MS))
    return Result(
        way,
        rate,
        len(recorded),
        len(set(payloads) - set(got)),
        _is_subsequence(got, payloads),
        round(len(recorded) / took_s, 1),
        *off_ms,
        beyond,
    )


def sleep_through(path: Path) -> Result:
    """A thread that wakes when each message of a recording is due, and does nothing then."""
    recorded = list(read(path))
    began_ns, woke = time.monotonic_ns(), list[tuple[int, bytes]]()
    for record in recorded:
        due_ns = began_ns + record.log_time_ns - recorded[0].log_time_ns
        time.sleep(max(0, due_ns - time.monotonic_ns()) * 1e-9)
        woke.append((time.monotonic_ns(), record.payload))
    return compare("sleeper", 1.0, (time.monotonic_ns() - began_ns) * 1e-9, recorded, woke)


def _is_subsequence(got: list[bytes], payloads: list[bytes]) -> bool:
    rest = iter(payloads)
    return all(payload in rest for payload in got)


async def run(seconds: float) -> list[Result]:
    """All measurements."""
    endpoint = free_endpoint()
    results = []
    line, theirs = Pipe()
    # Spawned: a forked process would have this one's Zenoh threads in pieces.
    listener = get_context("spawn").Process(target=listen, args=(endpoint, theirs), daemon=True)
    listener.start()
    line.recv()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        write_recording(path, seconds)
        results.append(await asyncio.to_thread(sleep_through, path))
        for rate in (1.0, 4.0, 0.0):
            for way, play in (("plain", plain), ("ours", ours)):
                results.append(await measure(way, play, endpoint, line, path, rate))
    line.send("end")
    listener.join()
    return results


def table(results: list[Result]) -> str:
    """What a person reads."""
    head = "way      rate  messages  lost  in order  messages/s  spacing off by: median  95 %  max"
    lines = [f"{head}  beyond 2 ms"]
    for r in results:
        off = "-" if r.max_ms is None else f"{r.median_ms:.3f}  {r.p95_ms:.3f}  {r.max_ms:.3f} ms"
        order = "yes" if r.in_order else "NO"
        lines.append(
            f"{r.way:8} {r.rate:4g}  {r.sent:8d}  {r.lost:4d}  {order:8}  {r.messages_s:10.0f}"
            f"  {off:>28}  {'-' if r.beyond is None else r.beyond:>11}"
        )
    return "\n".join(lines)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    results = uvloop.run(run(options.seconds))
    print(table(results))
    if options.json:
        options.json.write_text(json.dumps([asdict(r) for r in results], indent=1))


if __name__ == "__main__":
    main()
