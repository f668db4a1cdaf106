"""What the live page costs: the viewer's processor time and memory, and the pipeline's delay.

    python benchmarks/viewer.py [--seconds S] [--minutes M] [--visitor KIND] [--json FILE]

rhot-viewer is a process of its own, drawing at 60 Hz. This process plays the rest of the rig on the
loopback: poses and markers of two hands, two objects and who touches them, each 60 times a second,
from a simulated scene, and it measures a bystander's delay: from a pose's putting to its arrival at
another session. One visitor after the other comes:
    none      nobody looks
    one       one visitor, who reads all that comes
    slow      one who reads a message a second
    stopped   one who has stopped reading altogether (with --visitor chromium: SIGSTOP)
and the figures of each are
    cpu_percent  processor time of the viewer alone, of one core (mean over the seconds; worst: of
                 the worst second)
    rss_mb       its memory at the end, and how much it grew since the first such visitor came
    pictures_hz  pictures that the visitor was sent
    kb_s         what he was sent
    pose_ms      the bystander's delay: median, 95 %, worst
With --minutes the one visitor stays so long, and grown_mb is from the first minute's end on.
The visitor is a raw websocket (KIND socket), or a headless Chromium (KIND chromium), whose own
rendering in software takes whatever is left of the machine.
Linux only: processes are read from /proc.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any, NamedTuple, cast

import msgspec
import zenoh

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.zenoh_config import router_config
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import HandTable, ObjectTable, Viewer
from rhot.messages import Message
from services.simulator.files.rig_toml import rig_toml
from services.simulator.scene.scene import load_scene
from testing.loopback import free_endpoint
from testing.page_visitors import Visitor, chromium
from testing.scene_messages import hand_points, hand_pose, object_messages

RATE_HZ = 60.0
ROOT = Path(__file__).resolve().parent.parent
DEADLINE_S = 60.0
# How often the slow visitor reads.
_SLOW_S = 1.0
# A browser needs this long to draw its first picture in software.
_STARTS_S = 8.0


class Figures(NamedTuple):
    """What one kind of visitor costs."""

    cpu_percent: float
    cpu_percent_worst: float
    rss_mb: float
    grown_mb: float
    pictures_hz: float
    kb_s: float
    pose_ms: float
    pose_ms_95: float
    pose_ms_worst: float


def write_rig(folder: Path) -> RigConfig:
    """The simulated rig with both hands and two objects, in a folder of its own."""
    example = load_rig(ROOT / "config" / "sim.toml")
    right = example.hand["right"].markers
    box = ObjectTable(name="box", serial="LHR-SIM00002", shape="box", size_m=(0.06, 0.05, 0.09))
    config = msgspec.structs.replace(
        example,
        hand={
            "right": example.hand["right"],
            "left": HandTable(markers={mark: f"other-{color}" for mark, color in right.items()}),
        },
        object=[*example.object, box],
        viewer=Viewer(port=0, rate_hz=RATE_HZ),
        folder=str(folder),
    )
    (folder / "rig.toml").write_text(rig_toml(config, "benchmarks/viewer.py"), encoding="utf-8")
    (folder / "calibration").symlink_to(ROOT / "config" / "calibration")
    return config


def frames(count: int) -> list[list[Message]]:
    """Messages of both hands and both objects, in the order of `publishers`."""
    scene = load_scene(load_rig(ROOT / "config" / "sim.toml"), "two_hands")
    made = []
    for n in range(count):
        t_s = 1.0 + n / RATE_HZ
        poses = [
            hand_pose(name, hand, hand.state_at(t_s), 1, n) for name, hand in scene.hands.items()
        ]
        (cup, contacts), *_ = object_messages(scene, t_s, 1, n)
        x, y, z = cup.position_m
        sway_m = 0.002 * (n % 60)
        cup = msgspec.structs.replace(cup, position_m=(x, y, z + sway_m))
        box = msgspec.structs.replace(cup, object="box", position_m=(x - 0.2, y + sway_m, z))
        touched = msgspec.structs.replace(contacts, object="box")
        points = [hand_points(pose) for pose in poses]
        made.append([*poses, *points, cup, box, contacts, touched])
    return made


async def play(bus: Bus, made: list[list[Message]]) -> None:
    """Publish the frames to and fro at 60 Hz, for ever."""
    topic_of = {
        "HandPose": (topics.POSE, "hand"),
        "HandPoints": (topics.POINTS, "hand"),
        "ObjectPose": (topics.OBJECT, "object"),
        "ObjectContacts": (topics.CONTACTS, "object"),
    }
    publishers: list[Any] = []
    for message in made[0]:
        topic, name = topic_of[type(message).__name__]
        publishers.append(bus.publisher(cast("Any", topic), **{name: getattr(message, name)}))
    there_and_back = [*made, *made[-2:0:-1]]
    due_s, n = time.monotonic(), 0
    while True:
        for publisher, message in zip(
            publishers, there_and_back[n % len(there_and_back)], strict=True
        ):
            publisher.put(msgspec.structs.replace(message, stamp_ns=clock.now_ns()))
        n, due_s = n + 1, due_s + 1.0 / RATE_HZ
        await asyncio.sleep(max(0.0, due_s - time.monotonic()))


class Bystander:
    """Somebody who needs poses: how late they are."""

    def __init__(self) -> None:
        self.delays_ms: list[float] = []

    async def listen(self, endpoint: str, rig: str) -> None:
        """Take poses of one hand, for ever."""
        async with open_bus(rig, [endpoint]) as bus:
            async for pose in bus.latest(topics.POSE, hand="right"):
                self.delays_ms.append((clock.now_ns() - pose.sent_ns) * 1e-6)


class Bench:
    """The viewer's process, and what is measured of it."""

    def __init__(self, pid: int, port: int, bystander: Bystander, browser: str) -> None:
        self._pid, self._port, self._bystander, self._browser = pid, port, bystander, browser

    async def measure(self, kind: str, seconds: float, settle_s: float) -> Figures:
        """One kind of visitor, for so long after he has settled."""
        visitor = Visitor()
        async with self._visit(kind, visitor):
            await asyncio.sleep(settle_s)
            grown_from_mb = rss_mb(self._pid)
            self._bystander.delays_ms.clear()
            visitor.pictures = visitor.received_bytes = 0
            begun_s, each_s, shares = time.monotonic(), [cpu_seconds(self._pid)], []
            while (spent_s := time.monotonic() - begun_s) < seconds:
                at_s = time.monotonic()
                await asyncio.sleep(min(1.0, seconds - spent_s))
                each_s.append(cpu_seconds(self._pid))
                shares.append((each_s[-1] - each_s[-2]) / (time.monotonic() - at_s))
            spent_s = time.monotonic() - begun_s
            delays = sorted(self._bystander.delays_ms)
            return Figures(
                cpu_percent=round(100.0 * (each_s[-1] - each_s[0]) / spent_s, 1),
                cpu_percent_worst=round(100.0 * max(shares), 1),
                rss_mb=round(rss_mb(self._pid), 1),
                grown_mb=round(rss_mb(self._pid) - grown_from_mb, 1),
                pictures_hz=round(visitor.pictures / spent_s, 1),
                kb_s=round(visitor.received_bytes / spent_s * 1e-3, 1),
                pose_ms=round(statistics.median(delays), 2),
                pose_ms_95=round(delays[int(0.95 * (len(delays) - 1))], 2),
                pose_ms_worst=round(delays[-1], 2),
            )

    @contextlib.asynccontextmanager
    async def _visit(self, kind: str, visitor: Visitor) -> AsyncIterator[None]:
        if kind == "none":
            yield
        elif self._browser == "chromium" and kind != "slow":
            with chromium(self._port) as group:
                await asyncio.sleep(_STARTS_S)
                if kind == "stopped":
                    os.killpg(group, signal.SIGSTOP)
                yield
        else:
            wait_s = {"one": 0.0, "slow": _SLOW_S, "stopped": None}[kind]
            looking = asyncio.create_task(visitor.look(self._port, wait_s))
            try:
                yield
                if looking.done():
                    looking.result()
            finally:
                looking.cancel()
                await asyncio.gather(looking, return_exceptions=True)


def rss_mb(pid: int) -> float:
    """Resident memory of a process."""
    lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) * 1024e-6


def cpu_seconds(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def port_of_viewer(bus: Bus) -> int:
    """Where its page is, from its health."""
    async with asyncio.timeout(DEADLINE_S):
        async for beat in bus.every(topics.HEALTH, 16):
            if beat.service == "viewer" and beat.values.get("port"):
                return int(beat.values["port"])
    raise RuntimeError("rhot-viewer says no port")


@contextlib.contextmanager
def viewer(rig: str, endpoint: str) -> Iterator[int]:
    """The viewer's process: its id."""
    command = [sys.executable, "-m", "services.viewer", "--config", rig, "--connect", endpoint]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        yield process.pid
    finally:
        process.terminate()
        process.wait(DEADLINE_S)


async def run(options: argparse.Namespace) -> dict[str, Figures]:
    """All kinds of visitors, one after the other."""
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        config = write_rig(Path(folder))
        made = frames(round(4.0 * RATE_HZ))
        rig = f"{folder}/rig.toml"
        with zenoh.open(router_config([endpoint])), viewer(rig, endpoint) as pid:
            async with open_bus(config.rig.name, [endpoint]) as bus:
                port = await port_of_viewer(bus)
                bystander = Bystander()
                tasks = [
                    asyncio.create_task(play(bus, made)),
                    asyncio.create_task(bystander.listen(endpoint, config.rig.name)),
                ]
                bench = Bench(pid, port, bystander, options.visitor)
                figures = {}
                for kind in ("none", "one", "slow", "stopped"):
                    long = kind == "one" and options.minutes > 0
                    seconds = 60.0 * options.minutes if long else options.seconds
                    figures[kind] = await bench.measure(kind, seconds, 60.0 if long else 3.0)
                    for task in tasks:
                        if task.done():
                            task.result()
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
    return figures


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description="What the live page costs")
    parser.add_argument("--seconds", type=float, default=8.0, help="for each kind of visitor")
    parser.add_argument("--minutes", type=float, default=0.0, help="for the one visitor instead")
    parser.add_argument("--visitor", choices=("socket", "chromium"), default="socket")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    figures = asyncio.run(run(options))
    print(f"{'':18s}" + "".join(f"{kind:>10s}" for kind in figures))
    for name in Figures._fields:
        print(f"{name:18s}" + "".join(f"{getattr(one, name):10g}" for one in figures.values()))
    one = figures["one"].pose_ms
    for kind in ("slow", "stopped"):
        print(f"pose_ms of {kind} against one: {figures[kind].pose_ms / one:.2f}")
    if options.json:
        written = {kind: one._asdict() for kind, one in figures.items()}
        options.json.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
