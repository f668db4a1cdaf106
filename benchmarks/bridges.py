"""What bridges cost the rig: the latency of hand/pose at another subscriber, with and without them.

    python benchmarks/bridges.py [--bridges NAME ...] [--rounds N] [--seconds S] [--json FILE]

Two hands and an object at 60 Hz go through a router in a process of its own. Each round measures,
in another order each time and with processes started anew,
    none       no bridge runs
    onlookers  as many plain subscribers do nothing with what comes: what any program costs
    running    the bridges (--bridges) run, and a program takes what they send
    stopped    the same, and that program is stopped (SIGSTOP): its sockets are there, nobody reads
The last two take turns every half second, so that they differ in nothing else. Printed are medians
over the rounds of p50 and p99, of their ratios to `none` and to `running` of the same round, and
the processor time in percent of one core. Cores that others use as well make all but the last
ratios noise: the machine's load stands below. Linux only.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import selectors
import signal
import socket
import statistics
import sys
import tempfile
import threading
import time
from asyncio.subprocess import DEVNULL, PIPE
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import Any

import uvloop
import zenoh
from websockets.sync.client import connect

from rhot import topics
from rhot.bus.bus import Bus, client_config, open_bus
from rhot.hand import HANDS
from testing.loopback import free_endpoint, free_port
from testing.sample_hands import object_pose, random_pose

BRIDGES = ("vmc", "opengloves", "monado", "websocket", "foxglove", "ros2")
# To these the program connects; the others send to it.
SERVERS = ("websocket", "foxglove", "ros2")
BLOCKS = ("none", "onlookers", "bridges")
STATES = ("none", "onlookers", "running", "stopped")
RATE_HZ, SETTLE_S = 60.0, 0.7
# How long the program runs or is stopped at a time, and how much of that is left out at first.
TURN_S, EDGE_S = 0.5, 0.1
ROUTER = """
import sys, threading, zenoh
from rhot.bus.zenoh_config import router_config
with zenoh.open(router_config([sys.argv[1]])):
    print("listens", flush=True)
    threading.Event().wait()
"""

ONLOOKER = """
import asyncio, sys
from rhot import topics
from rhot.bus.bus import open_bus
async def look():
    async with open_bus("desk", [sys.argv[1]]) as bus:
        poses, objects = bus.latest(topics.POSE), bus.latest(topics.OBJECT)
        bus.alive("bridge", sys.argv[2])
        async def take(subscription):
            async for _ in subscription:
                pass
        await asyncio.gather(take(poses), take(objects))
asyncio.run(look())
"""


def connect_to(name: str, port: int, endpoint: str) -> None:
    """Take what a bridge tells who connects, as soon as it is there."""
    if name == "ros2":
        session = zenoh.open(client_config([endpoint]))
        session.declare_subscriber("0/**", lambda sample: sample.payload.to_bytes())
        threading.Event().wait()
    spoken: Any = ["foxglove.sdk.v1"] if name == "foxglove" else None
    while True:
        with (
            contextlib.suppress(OSError),
            connect(f"ws://127.0.0.1:{port}", subprotocols=spoken) as link,
        ):
            for text in link:
                told = json.loads(text).get("channels", ()) if isinstance(text, str) else ()
                wanted = [{"id": one["id"], "channelId": one["id"]} for one in told]
                if wanted:
                    link.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        time.sleep(0.05)


def consume(names: Sequence[str], endpoint: str) -> None:
    """A program with a port for each bridge, which takes what comes."""
    selector = selectors.DefaultSelector()
    ports = []
    for name in names:
        if name in SERVERS:
            ports.append(free_port())
            threading.Thread(
                target=connect_to, args=(name, ports[-1], endpoint), daemon=True
            ).start()
            continue
        kind = socket.SOCK_STREAM if name == "monado" else socket.SOCK_DGRAM
        ear = socket.socket(socket.AF_INET, kind)
        ear.bind(("127.0.0.1", 0))
        if kind == socket.SOCK_STREAM:
            ear.listen()
        selector.register(ear, selectors.EVENT_READ, kind == socket.SOCK_STREAM)
        ports.append(ear.getsockname()[1])
    print(*ports, flush=True)
    while True:
        for key, _ in selector.select():
            one: Any = key.fileobj
            if key.data:
                selector.register(one.accept()[0], selectors.EVENT_READ, False)
            else:
                one.recv(65_536)


@contextlib.asynccontextmanager
async def process(*command: str, says: bool = False) -> AsyncIterator[tuple[int, str]]:
    """(pid, its first line) of a process that ends with the block."""
    started = await asyncio.create_subprocess_exec(
        sys.executable, *command, stdout=PIPE if says else DEVNULL, stderr=DEVNULL
    )
    try:
        line = (await started.stdout.readline()).decode() if started.stdout else ""
        yield started.pid, line
    finally:
        with contextlib.suppress(ProcessLookupError):
            started.send_signal(signal.SIGCONT)
            started.kill()
        await started.communicate()


@contextlib.asynccontextmanager
async def company(
    block: str, names: Sequence[str], bus: Bus, endpoint: str, folder: Path
) -> AsyncIterator[tuple[list[int], int]]:
    """Pids of who listens to the rig, once all do, and of the program behind the bridges or 0."""
    async with contextlib.AsyncExitStack() as stack:
        if block == "none":
            yield [], 0
            return
        own = (__file__, "--consume", endpoint, "--bridges", *names)
        consumer, line = await stack.enter_async_context(process(*own, says=True))
        tables = [f'[bus]\nconnect = ["{endpoint}"]']
        for name, port in zip(names, line.split(), strict=True):
            at = "" if name == "ros2" else f"port = {port}"
            tables.append(f"[bridges.{name}]\nenabled = true\n{at}")
        (folder / "rig.toml").write_text("\n".join(tables))
        watch, alive, pids = bus.watch_alive(), set(), []
        for name in names:
            command = ("-c", ONLOOKER, endpoint, name)
            if block == "bridges":
                options = ("--config", str(folder / "rig.toml"), "--instance", name)
                command = ("-m", "services.bridges", *options)
            pid, _ = await stack.enter_async_context(process(*command))
            pids.append(pid)
        async with asyncio.timeout(60.0):
            while alive != set(names):
                change = await anext(watch)
                if change.service == "bridge" and change.alive:
                    alive.add(change.instance)
        bus.close(watch)
        yield pids, consumer if block == "bridges" else 0


def cpu_s(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def latencies_ms(bus: Bus, seconds: float, consumer: int) -> tuple[list[float], ...]:
    """From put to the subscriber's loop, of each pose after a while to settle; sorted.

    Where there is a consumer: while it runs, and while it is stopped.
    """
    found: tuple[list[float], list[float]] = ([], [])
    begin_s = next_s = time.monotonic() + SETTLE_S

    async def receive() -> None:
        async for pose in subscription:
            age_ns = time.time_ns() - pose.sent_ns
            turn, into_turn_s = divmod(time.monotonic() - begin_s, TURN_S)
            if turn >= 0.0 and into_turn_s > EDGE_S:
                found[int(turn) % 2 if consumer else 0].append(age_ns * 1e-6)

    subscription = bus.every(topics.POSE, 64)
    receiving = asyncio.create_task(receive())
    poses = {hand: random_pose(hand, 1) for hand in HANDS}
    hands = {hand: bus.publisher(topics.POSE, hand=hand) for hand in HANDS}
    cups = bus.publisher(topics.OBJECT, object="cup")
    next_s -= SETTLE_S
    stopped = False
    while next_s - begin_s < seconds:
        for hand, publisher in hands.items():
            publisher.put(poses[hand])
        cups.put(object_pose("cup"))
        if consumer and next_s > begin_s and stopped != int((next_s - begin_s) / TURN_S) % 2:
            stopped = not stopped
            os.kill(consumer, signal.SIGSTOP if stopped else signal.SIGCONT)
        next_s += 1.0 / RATE_HZ
        await asyncio.sleep(next_s - time.monotonic())
    receiving.cancel()
    for one in (subscription, *hands.values(), cups):
        bus.close(one)
    return tuple(map(sorted, found[: 1 + bool(consumer)]))


async def measure(
    names: Sequence[str], rounds: int, seconds: float
) -> list[dict[str, dict[str, float]]]:
    """Of each round: p50_ms, p99_ms and cpu_percent of each state."""
    endpoint = free_endpoint()
    results = []
    with tempfile.TemporaryDirectory() as folder:
        async with (
            process("-c", ROUTER, endpoint, says=True),
            open_bus("desk", [endpoint]) as bus,
            open_bus("desk", [endpoint]) as onlooker,
        ):
            for number in range(rounds):
                result: dict[str, dict[str, float]] = {}
                for k in range(len(BLOCKS)):
                    block = BLOCKS[(k + number) % len(BLOCKS)]
                    async with company(block, names, onlooker, endpoint, Path(folder)) as (
                        pids,
                        consumer,
                    ):
                        before_s, begin_s = sum(map(cpu_s, pids)), time.monotonic()
                        found = await latencies_ms(bus, seconds * (1 + bool(consumer)), consumer)
                        used_s = sum(map(cpu_s, pids)) - before_s
                        states = ("running", "stopped") if consumer else (block,)
                        for state, values in zip(states, found, strict=True):
                            result[state] = {
                                "p50_ms": statistics.median(values),
                                "p99_ms": values[int(0.99 * len(values))],
                                "cpu_percent": 100.0 * used_s / (time.monotonic() - begin_s),
                            }
                results.append(result)
    return results


def summary(results: Sequence[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Medians over the rounds, and of each round's ratios to `none` and to `running`."""
    found = {}
    for state in STATES:
        rows = [result[state] for result in results]
        figures = {name: statistics.median(row[name] for row in rows) for name in rows[0]}
        for base in ("none", "running"):
            for name in ("p50", "p99"):
                ratios = [r[state][f"{name}_ms"] / r[base][f"{name}_ms"] for r in results]
                figures[f"{name}_to_{base}"] = statistics.median(ratios)
        found[state] = figures
    return found


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--seconds", type=float, default=3.0, help="of each state in each round")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--bridges", nargs="+", choices=BRIDGES, default=list(BRIDGES[:3]))
    parser.add_argument("--consume", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.consume:
        consume(options.bridges, options.consume)
        return
    found = summary(uvloop.run(measure(options.bridges, options.rounds, options.seconds)))
    columns = ["p50_ms", "p99_ms", "p50_to_none", "p99_to_none", "p50_to_running", "p99_to_running"]
    print(
        f"{'':<10}" + "".join(f"{name.replace('_', ' '):>16}" for name in (*columns, "cpu_percent"))
    )
    for state, row in found.items():
        print(
            f"{state:<10}"
            + "".join(f"{row[name]:16.3f}" for name in columns)
            + f"{row['cpu_percent']:16.1f}"
        )
    print(f"load of this machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
