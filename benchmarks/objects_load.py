"""What 16 objects cost that are tracked live: processor time, messages lost, delay.

    python benchmarks/objects_load.py [--seconds S] [--json FILE]

rhot-object-tracker as it is started, a process of its own on a real router, receives 16 trackers at
250 Hz from a third process that only sends, and publishes 16 objects.

    objects_cpu          its processor time over the run, as a share of one core
    lost                 messages that were sent, and never published
    latency_p50_ms       from a pose's stamp to the object's arrival
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import zenoh

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.bus.zenoh_config import client_config, router_config
from rhot.files.calibration import save
from rhot.messages.objects import ObjectPose
from testing.loopback import free_endpoint
from testing.openvr_poses import openvr_pose, registered

RIG, TRACKERS, RATE_HZ, UNIVERSE = "objects", 16, 250.0, "raw:1"


def send(endpoint: str, seconds: float) -> None:
    """The third process: 16 hands that wave, for so long; prints how many messages it sent."""
    encode, rng = msgspec.json.Encoder().encode, np.random.default_rng(0)
    serials = [f"LHR-{k:02d}" for k in range(TRACKERS)]
    with zenoh.open(client_config([endpoint])) as session:
        publishers = [
            session.declare_publisher(
                topics.OPENVR.key(RIG, serial=serial),
                congestion_control=zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.REAL_TIME,
                express=True,
            )
            for serial in serials
        ]
        while not all(publisher.matching_status.matching for publisher in publishers):
            time.sleep(0.01)
        time.sleep(0.5)
        begin_s, steps = time.monotonic(), round(seconds * RATE_HZ)
        noise = rng.normal(0.0, 3e-4, (steps, 3)).tolist()
        for seq in range(steps):
            time.sleep(max(0.0, begin_s + seq / RATE_HZ - time.monotonic()))
            angle, now_ns = 0.02 * seq, time.time_ns()
            c, s, (x, y, z) = math.cos(angle), math.sin(angle), noise[seq]
            rows = ((c, 0.0, s, 0.3 * s + x), (0.0, 1.0, 0.0, 1.0 + y), (-s, 0.0, c, 0.2 * c + z))
            for serial, publisher in zip(serials, publishers, strict=True):
                publisher.put(
                    encode(
                        openvr_pose(
                            rows,
                            serial,
                            seq=seq,
                            stamp_ns=now_ns,
                            universe=UNIVERSE,
                            vVelocity=(1.5 * c, 0.0, 0.0),
                            clock_sigma_ns=100_000,
                        )
                    )
                )
        time.sleep(1.0)
    print(steps * TRACKERS)


@contextlib.contextmanager
def object_tracker(endpoint: str) -> Iterator[subprocess.Popen[bytes]]:
    """rhot-object-tracker with 16 registered objects."""
    with tempfile.TemporaryDirectory() as folder:
        rig = [f'[rig]\nname = "{RIG}"\n[bus]\nconnect = ["{endpoint}"]\n[objects]']
        rig += [f'source = "network"\nrate_hz = {RATE_HZ}']
        rig += [f'[[object]]\nname = "o{k}"\nserial = "LHR-{k:02d}"' for k in range(TRACKERS)]
        (Path(folder) / "rig.toml").write_text("\n".join(rig) + "\n")
        save(Path(folder) / "calibration" / "objects.json", registered(universe=UNIVERSE))
        command = [sys.executable, "-m", "services.object_tracker", "--config"]
        silent = subprocess.DEVNULL
        command.append(f"{folder}/rig.toml")
        process = subprocess.Popen(command, stdout=silent, stderr=silent)
        try:
            yield process
        finally:
            process.terminate()
            process.wait(10.0)


def cpu_s(pid: int) -> float:
    """Processor time of a process with all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def load(seconds: float) -> dict[str, float]:
    """objects_cpu, lost and the latency of 16 trackers at 250 Hz."""
    endpoint = free_endpoint()
    # A process of its own: the router's threads are not the tracker's.
    with zenoh.open(router_config([endpoint])), object_tracker(endpoint) as process:
        async with open_bus(RIG, [endpoint]) as bus:
            objects = bus.raw(topics.OBJECT, 4096)
            found = bus.watch_alive()
            async for alive in found:
                if alive.service == "object_tracker":
                    break
            script = [sys.executable, __file__, "--send", endpoint, "--seconds", str(seconds)]
            sender = await asyncio.create_subprocess_exec(*script, stdout=subprocess.PIPE)
            payloads: list[tuple[bytes, int]] = []
            reader = asyncio.create_task(collect(objects, payloads))
            while not payloads:
                await asyncio.sleep(0.01)
            before_s, began_s = cpu_s(process.pid), time.monotonic()
            await asyncio.sleep(0.9 * seconds)
            share = (cpu_s(process.pid) - before_s) / (time.monotonic() - began_s)
            sent = int((await sender.communicate())[0])
            reader.cancel()
    poses = [(msgspec.json.decode(one, type=ObjectPose), at_ns) for one, at_ns in payloads]
    good = [(pose, at_ns) for pose, at_ns in poses if pose.tracking == "ok"]
    ages_ms = sorted((at_ns - pose.stamp_ns) * 1e-6 for pose, at_ns in good)
    return {
        "objects_cpu": round(share, 3),
        "sent": sent,
        "lost": sent - len(good),
        "latency_p50_ms": round(ages_ms[len(ages_ms) // 2], 2),
        "latency_p99_ms": round(ages_ms[int(0.99 * len(ages_ms))], 2),
    }


async def collect(objects: Any, payloads: list[tuple[bytes, int]]) -> None:
    """Keep what arrives, undecoded."""
    async for sample in objects:
        payloads += [(sample.payload, sample.received_ns)]


def report(figures: dict[str, float], path: Path | None) -> None:
    """Print the table, and write it."""
    for name, value in figures.items():
        print(f"{name:<22} {value:>12g}")
    if path:
        path.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--send", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.send:
        send(options.send, options.seconds)
        return
    report(asyncio.run(load(options.seconds)), options.json)


if __name__ == "__main__":
    main()
