"""Publishers gone mad against a rig that tracks a hand: what they may cost.

Memory of all stays within one and a half; the right camera's markers, and the poses that fusion and
solver make of both cameras', keep their rate.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import msgspec
import pytest

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.hand import BASIC_LANDMARKS
from rhot.messages import MarkerFrame
from testing.sample_health import beat
from testing.secured_rig import SecuredRig
from testing.synthetic_points import COLORS, MovingHand, SyntheticRig, frames

pytestmark = pytest.mark.field

START_S = 60.0
FLOOD_S = 120.0
RATE_HZ = 30.0
# Zenoh drops live data rather than wait for a machine that is busy with the flood itself; a link
# that were stalled would lose nearly all.
MAX_LOST = 0.2
_SERVICES = ("fusion", "solver", "recorder", "viewer")
# Cameras whose clocks are the master's, before a hand that keeps still, for a second.
_SETUP = SyntheticRig(skew_s=0.0, drift_ppm=0.0, clock_error_s=0.0, loss=0.0)
_SECOND = frames(_SETUP, MovingHand(speed_m_s=0.0), 1.0)
_MORE = (
    "\n".join(
        f'{landmark} = "{color}"'
        for landmark, color in zip(BASIC_LANDMARKS, COLORS, strict=True)
        if landmark != "index_tip"
    )
    + """
[viewer]
port = 0
[recorder]
autostart = true
"""
)
FRAME = MarkerFrame(
    camera="NAME",
    seq=1,
    stamp_ns=clock.now_ns(),
    row_time_ns=0,
    clock_offset_ns=0,
    clock_sigma_ns=0,
    size_px=(640, 480),
    markers=[],
)
HEALTH = beat("stranger", "NAME", stamp_ns=clock.now_ns(), streams=[])


class Flooded:
    """The rig's processes, their memory, and the markers and poses that should arrive meanwhile."""

    def __init__(self, rig: SecuredRig, processes: dict[str, asyncio.subprocess.Process]) -> None:
        self.rig, self.processes = rig, processes
        self.peak_mb: dict[str, float] = {}
        self.sent = 0
        self.arrived = {"markers": 0, "poses": 0}

    def rss_mb(self) -> dict[str, float]:
        return {name: _rss_mb(process.pid) for name, process in self.processes.items()}

    async def watch_memory(self) -> None:
        while True:
            for name, now_mb in self.rss_mb().items():
                self.peak_mb[name] = max(now_mb, self.peak_mb.get(name, 0.0))
            await asyncio.sleep(0.05)

    async def send_markers(self, cameras: dict[str, Bus]) -> None:
        """Both cameras' frames as they are exposed, each from its own host."""
        publishers = {
            name: bus.publisher(topics.MARKERS, camera=name) for name, bus in cameras.items()
        }
        loop = asyncio.get_running_loop()
        began_s, began_ns = loop.time(), clock.now_ns()
        for second in itertools.count():
            for frame in _SECOND:
                age_ns = second * 10**9 + frame.stamp_ns - _SECOND[0].stamp_ns
                await asyncio.sleep(began_s + age_ns * 1e-9 - loop.time())
                seq = second * 30 + frame.seq
                publishers[frame.camera].put(
                    msgspec.structs.replace(frame, seq=seq, stamp_ns=began_ns + age_ns)
                )
                self.sent += int(frame.camera == "right")

    async def receive_markers(self, bus: Bus) -> None:
        async for _ in bus.raw(topics.MARKERS, 256, camera="right"):
            self.arrived["markers"] += 1

    async def receive_poses(self, bus: Bus) -> None:
        async for pose in bus.every(topics.POSE, 256):
            solved = all(finger.status != "predicted" for finger in pose.fingers)
            self.arrived["poses"] += int(solved)

    async def flood(self, endpoint: str, kind: str, key: str, payload: str = "{}") -> None:
        """Run a flood to its end; then memory and rate are what they should be."""
        before_mb, self.peak_mb = self.rss_mb(), {}
        sent, arrived = self.sent, dict(self.arrived)
        flood = await _start("testing.flood", endpoint, kind, key, payload)
        async with asyncio.timeout(FLOOD_S):
            assert await flood.wait() == 0
        await asyncio.sleep(1.0)
        for name, process in self.processes.items():
            assert process.returncode is None, f"{name} has ended"
            assert self.peak_mb[name] <= 1.5 * before_mb[name], (name, kind, key)
        for what, before in arrived.items():
            lost = 1.0 - (self.arrived[what] - before) / (self.sent - sent)
            assert lost <= MAX_LOST, (kind, key, f"{lost:.1%} of the {what} were lost")


def _rss_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096 / 1e6


async def _start(module: str, *arguments: str) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        sys.executable, "-m", module, *arguments, stdout=asyncio.subprocess.DEVNULL
    )


@contextlib.asynccontextmanager
async def _processes(rig: SecuredRig) -> AsyncIterator[dict[str, asyncio.subprocess.Process]]:
    config = ("--config", str(rig.path))
    processes = {"router": await _start("services.cli", "router", *config)}
    try:
        for name in _SERVICES:
            processes[name] = await _start(f"services.{name}", *config)
        yield processes
    finally:
        for process in processes.values():
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


@pytest.fixture
async def flooded(tmp_path) -> AsyncIterator[Flooded]:
    rig = SecuredRig(tmp_path)
    rig.path.write_text(rig.path.read_text() + _MORE)
    _SETUP.save_calibration(tmp_path / "calibration")
    async with contextlib.AsyncExitStack() as stack:
        processes = await stack.enter_async_context(_processes(rig))
        async with asyncio.timeout(START_S):
            here = await stack.enter_async_context(open_bus("desk", rig.open))
            cameras = {
                name: await stack.enter_async_context(open_bus("desk", rig.as_host(name)))
                for name in ("left", "right")
            }
            alive, expected = here.watch_alive(), set(_SERVICES)
            while expected:
                expected.discard((await anext(alive)).service)
        flooded = Flooded(rig, processes)
        tasks = await stack.enter_async_context(asyncio.TaskGroup())
        running = [
            tasks.create_task(flooded.receive_markers(here)),
            tasks.create_task(flooded.receive_poses(here)),
            tasks.create_task(flooded.send_markers(cameras)),
            tasks.create_task(flooded.watch_memory()),
        ]
        async with asyncio.timeout(START_S):
            while min(flooded.arrived.values()) < 30:
                await asyncio.sleep(0.05)
        yield flooded
        for task in running:
            task.cancel()


def _text(message: msgspec.Struct) -> str:
    return msgspec.json.encode(message).decode()


OWN = topics.MARKERS.key("desk", camera="left")


async def test_a_camera_gone_mad(flooded):
    (left,) = flooded.rig.as_host("left")
    await flooded.flood(left, "huge", OWN)
    await flooded.flood(left, "garbage", OWN)
    await flooded.flood(left, "garbage", topics.POSE.key("desk", hand="right"))
    await flooded.flood(left, "names", topics.MARKERS.key("desk", camera="NAME"), _text(FRAME))


async def test_an_object_source_that_names_ever_more_devices(flooded):
    (steamvr,) = flooded.rig.as_host("steamvr")
    await flooded.flood(steamvr, "names", topics.OPENVR.key("desk", serial="NAME"))


async def test_a_program_on_the_master_gone_mad(flooded):
    (here,) = flooded.rig.open
    await flooded.flood(here, "huge", OWN)
    await flooded.flood(here, "garbage", OWN)
    await flooded.flood(here, "names", topics.MARKERS.key("desk", camera="NAME"), _text(FRAME))
    health = topics.HEALTH.key("desk", service="stranger", instance="NAME")
    await flooded.flood(here, "names", health, _text(HEALTH))
