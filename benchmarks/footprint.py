"""What the tracker needs of a Raspberry Pi: start-up time, memory, processor time, imports.

    python benchmarks/footprint.py [--runs N] [--seconds S] [--json FILE]

rhot-pi-tracker is started as systemd starts it: a process of its own with six colours, connected to
a router on the loopback. This process plays the camera (640 x 480 YUV420 at 30 frames a second,
over the bus) and the master that has started the session. Measured:
    start_s         from exec to the liveliness token: the median of the runs (start_worst_s: the
                    slowest)
    start_cpu_s     processor time for that: what start_s would be on an idle core
    first_marker_s  from exec to the first MarkerFrame
    peak_mb         peak resident memory after --seconds of tracking while the preview is watched
                    (VmHWM); 1 MB is 10^6 bytes
    cpu_percent     of one core at 30 frames a second, preview included
    modules         number of modules it imported from start to end
    forbidden       those of scipy, numba and viser among them
Linux only: memory is read from /proc.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import statistics
import sys
import tempfile
import time
from asyncio.subprocess import DEVNULL, PIPE, Process
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, NamedTuple

import zenoh

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.zenoh_config import router_config
from rhot.files.calibration import save
from rhot.messages import Session
from rhot.messages.simulator import SimFrame
from testing import synthetic_images
from testing.loopback import free_endpoint

RIG, CAMERA, SIZE, FPS = "footprint", "left", (640, 480), 30.0
FORBIDDEN = ("scipy", "numba", "llvmlite", "viser")
DEADLINE_S = 30.0
LANDMARKS = ("wrist", "thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip")


class Run(NamedTuple):
    """One life of the service."""

    start_s: float
    start_cpu_s: float
    first_marker_s: float
    peak_mb: float
    cpu_percent: float
    modules: set[str]


def write_rig(folder: Path) -> Path:
    """rig.toml and the colours of a simulated camera; the path of the former."""
    markers = "\n".join(
        f'{landmark} = "{color}"'
        for landmark, color in zip(LANDMARKS, synthetic_images.PAINTS, strict=True)
    )
    path = folder / "rig.toml"
    path.write_text(
        f'[rig]\nname = "{RIG}"\n[[camera]]\nname = "{CAMERA}"\nsource = "simulator"\n'
        f"[hand.right.markers]\n{markers}\n"
    )
    (folder / "calibration").mkdir()
    save(folder / "calibration" / f"{CAMERA}.colors.json", synthetic_images.ranges())
    return path


def pictures() -> list[bytes]:
    """Pictures of six painted tips that move a little, as I420 bytes."""
    images = []
    for n in range(8):
        tips = [
            synthetic_images.Tip(color, 200.0 + 45 * i + 2 * n, 200.0 + 30 * (i % 3) + n)
            for i, color in enumerate(synthetic_images.PAINTS)
        ]
        noisy = synthetic_images.noisy(synthetic_images.clean(tips, SIZE)[0], 5.0, n)
        images.append(synthetic_images.i420(noisy).tobytes())
    return images


async def play(bus: Bus, images: list[bytes]) -> None:
    """Publish the pictures as the camera does, for ever."""
    camera, seq = bus.publisher(topics.SIM_FRAME, camera=CAMERA), 0
    while True:
        if camera.wanted:
            header = SimFrame(
                camera=CAMERA,
                seq=seq,
                stamp_ns=time.time_ns(),
                row_time_ns=3e4,
                size_px=SIZE,
                clock_skew_ns=0,
            )
            camera.put_bytes(images[seq % len(images)], header)
            seq += 1
        await asyncio.sleep(1.0 / FPS)


@contextlib.asynccontextmanager
async def tracker(rig: Path, endpoint: str, *, imports: bool) -> AsyncIterator[Process]:
    """The service's process; with imports it lists on stderr what it imports."""
    program = Path(sys.executable).with_name("rhot-pi-tracker")
    environment = os.environ | ({"PYTHONPROFILEIMPORTTIME": "1"} if imports else {})
    process = await asyncio.create_subprocess_exec(
        program,
        "--config",
        rig,
        "--camera",
        CAMERA,
        "--connect",
        endpoint,
        stdout=DEVNULL,
        stderr=PIPE if imports else DEVNULL,
        env=environment,
    )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()


async def one_run(
    bus: Bus, rig: Path, endpoint: str, seconds: float, *, imports: bool = False
) -> Run:
    """Start the tracker, let it work, read its memory, end it."""
    markers, alive = bus.every(topics.MARKERS, 64, camera=CAMERA), bus.watch_alive()
    previews = bus.raw(topics.PREVIEW, 4, camera=CAMERA)
    begun_s = time.monotonic()
    async with tracker(rig, endpoint, imports=imports) as process:
        imported = asyncio.ensure_future(process.stderr.read()) if process.stderr else None
        async for one in alive:
            if one.alive and one.service == "pi_tracker":
                break
        start_s, start_cpu_s = time.monotonic() - begun_s, cpu_seconds(process.pid)
        async for frame in markers:
            if len(frame.markers) == len(synthetic_images.PAINTS):
                break
        first_s = time.monotonic() - begun_s
        cpu_s, since_s = cpu_seconds(process.pid), time.monotonic()
        await asyncio.sleep(seconds)
        busy = (cpu_seconds(process.pid) - cpu_s) / (time.monotonic() - since_s)
        peak_mb = peak_memory_mb(process.pid)
        process.terminate()
        lines = (await imported).decode().splitlines() if imported else []
    # "import time:       123 |        456 |   numpy.linalg"
    modules = {line.rpartition("|")[2].strip() for line in lines if line.startswith("import time:")}
    for subscription in (markers, previews):
        bus.close(subscription)
    alive.undeclare()
    return Run(start_s, start_cpu_s, first_s, peak_mb, 100.0 * busy, modules)


def peak_memory_mb(pid: int) -> float:
    """Peak resident memory of a process."""
    lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    peak_kib = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    return peak_kib * 1024e-6


def cpu_seconds(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def measure(runs: int, seconds: float) -> dict[str, Any]:
    """All figures."""
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        rig = write_rig(Path(folder))
        with zenoh.open(router_config([endpoint])):
            async with open_bus(RIG, [endpoint]) as bus:
                bus.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
                camera = asyncio.ensure_future(play(bus, pictures()))
                async with asyncio.timeout(DEADLINE_S + seconds):
                    with_imports = await one_run(bus, rig, endpoint, 2.0, imports=True)
                lives = []
                for _ in range(runs):
                    async with asyncio.timeout(DEADLINE_S + seconds):
                        lives.append(await one_run(bus, rig, endpoint, seconds))
                camera.cancel()
    starts = [life.start_s for life in lives]
    return {
        "start_s": round(statistics.median(starts), 3),
        "start_worst_s": round(max(starts), 3),
        "start_cpu_s": round(statistics.median(life.start_cpu_s for life in lives), 3),
        "first_marker_s": round(statistics.median(life.first_marker_s for life in lives), 3),
        "peak_mb": round(max(life.peak_mb for life in lives), 1),
        "cpu_percent": round(statistics.median(life.cpu_percent for life in lives), 1),
        "modules": len(with_imports.modules),
        "forbidden": sorted(
            name for name in with_imports.modules if name.partition(".")[0] in FORBIDDEN
        ),
    }


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description="Start, memory and imports of rhot-pi-tracker")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    figures = asyncio.run(measure(max(1, options.runs), options.seconds))
    for name, value in figures.items():
        print(f"{name:16s} {value}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
