"""Latency of one message through a router: bare Zenoh and rhot's typed streams, in one process.

    python benchmarks/bus.py [--json FILE]

Prints medians and the ratio to the bare callback; the absolute times are this machine's.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import statistics
import threading
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import uvloop
import zenoh

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.bus.zenoh_config import client_config, router_config
from rhot.messages import Marker, MarkerFrame
from testing.loopback import free_endpoint

MESSAGES, WARM_UP = 1000, 100


def frame() -> MarkerFrame:
    """A MarkerFrame of six markers."""
    markers = [
        Marker(
            color=f"c{i}", x_px=100.123 + i, y_px=200.456, area_px=64.0, sigma_px=0.05, quality=1.0
        )
        for i in range(6)
    ]
    return MarkerFrame(
        camera="left",
        seq=1,
        stamp_ns=time.time_ns(),
        row_time_ns=33_700.0,
        clock_offset_ns=0,
        clock_sigma_ns=0,
        size_px=(640, 480),
        markers=markers,
    )


def bare(endpoint: str) -> list[float]:
    """Latencies of Zenoh alone, us: put in one session, callback in another."""
    key, arrived = "bench/bare", threading.Event()
    received: list[int] = []
    with (
        zenoh.open(client_config([endpoint])) as sender,
        zenoh.open(client_config([endpoint])) as receiver,
    ):
        receiver.declare_subscriber(
            key, lambda _: (received.append(time.perf_counter_ns()), arrived.set())
        )
        publisher = sender.declare_publisher(key, express=True)
        while not publisher.matching_status.matching:
            time.sleep(0.01)
        payload, started = b"x" * 600, []
        for _ in range(MESSAGES):
            arrived.clear()
            started.append(time.perf_counter_ns())
            publisher.put(payload)
            arrived.wait(5.0)
    return [(end - start) / 1e3 for start, end in zip(started, received, strict=True)][WARM_UP:]


async def typed(endpoint: str, receive: str) -> list[float]:
    """Latencies of rhot's bus, us: encode, put, wake the event loop, decode."""
    latencies = []
    async with open_bus("bench", [endpoint]) as sender, open_bus("bench", [endpoint]) as receiver:
        subscription = {
            "every": lambda: receiver.every(topics.MARKERS, 64),
            "latest": lambda: receiver.latest(topics.MARKERS),
            "raw": lambda: receiver.raw(topics.MARKERS, 64),
        }[receive]()
        publisher = sender.publisher(topics.MARKERS, camera="left")
        while not publisher.wanted:
            await asyncio.sleep(0.01)
        message = frame()
        for _ in range(MESSAGES):
            started = time.perf_counter_ns()
            publisher.put(message)
            await anext(subscription)
            latencies.append((time.perf_counter_ns() - started) / 1e3)
    return latencies[WARM_UP:]


def main() -> None:
    """Measure every way to receive and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    endpoint = free_endpoint()
    ways: dict[str, Callable[[], list[float] | Awaitable[list[float]]]] = {
        "bare Zenoh callback": lambda: bare(endpoint),
        "rhot raw()": lambda: typed(endpoint, "raw"),
        "rhot every(64)": lambda: typed(endpoint, "every"),
        "rhot latest()": lambda: typed(endpoint, "latest"),
    }
    results = {}
    with zenoh.open(router_config([endpoint])):
        for name, way in ways.items():
            outcome = way()
            latencies = sorted(outcome if isinstance(outcome, list) else uvloop.run(outcome))
            results[name] = {
                "p50_us": statistics.median(latencies),
                "p99_us": latencies[int(0.99 * len(latencies))],
            }
    base = results["bare Zenoh callback"]["p50_us"]
    print(f"{'way':<22} {'p50 us':>8} {'p99 us':>8} {'ratio':>6}")
    for name, result in results.items():
        result["ratio"] = result["p50_us"] / base
        print(
            f"{name:<22} {result['p50_us']:>8.0f} {result['p99_us']:>8.0f} {result['ratio']:>6.2f}"
        )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
