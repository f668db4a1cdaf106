"""A simulated rig under random faults: does it run for weeks?

    python benchmarks/soak.py [--minutes 30] [--seed 1] [--out soak]     (make soak MINUTES=30)

All of `rhot demo`'s processes and a recorder, real, on this machine. In the first quarter faults
end processes (kill -9 of any, the router too). Then, to warm up, every process is stopped once,
every other kind of fault comes six times and pictures are asked for a dozen times: what a first
garbage message or picture allocates, or a first time that somebody does not read, is no growth.
From there on the same faults come at random, all processes of the rig stay alive, and their memory
counts; testing/memory_growth.py says how. A pose counts if no finger of it is only predicted.
Writes OUT.md, OUT.png and OUT.json (samples of each process' memory: s, MB), and prints the report;
exit code 1 if something falls short.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path

import uvloop
from soak_faults import PICTURES, Fault, Faults
from soak_report import markdown, plot
from soak_statistics import Recovery, Run, shortfalls

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.files.config import load_rig
from services.cli.live.supervisor import Child, Supervisor, service_argv
from services.cli.live.up import children_of
from services.cli.live.working_copy import working_copy

PAGE_MB = resource.getpagesize() / 1e6
# Given up is ten times as late as wanted (2 s).
SAMPLE_S, FIRST_POSE_S, GIVE_UP_S = 5.0, 180.0, 20.0
# Of the run: then faults no longer end processes.
LETHAL_SHARE = 0.2
PAUSE_S, WARM_UP_PAUSE_S = (15.0, 40.0), (3.0, 6.0)
# Of every kind so many: with three the recorder's heap found new largest moments for another ten
# minutes (64.4 to 66.2 MB, the same in two runs), at eight times the messages it is flat from then.
WARM_UP_ROUNDS = 6
# The heap of a tracker that encodes pictures beside its frames is as large as it gets after a dozen
# floods of questions: 13.9 MB before, 22.7 after 14, 22.8 after 21 (frames of 640 x 480).
WARM_UP_FLOODS = 20
ENDPOINT = "tcp/127.0.0.1:17947"


def rss_mb(pid: int) -> float | None:
    """Resident memory of a process, None once it has ended."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_MB
    except (OSError, IndexError):
        return None


class Soak:
    """One run."""

    def __init__(self, seconds: float, seed: int) -> None:
        self.run = Run(seconds=seconds)
        self._seed = seed
        self._began_s = 0.0
        self._last_pose_s = float("-inf")
        self._supervisor = Supervisor(lambda *_: None)

    def now_s(self) -> float:
        return time.monotonic() - self._began_s

    async def go(self, path: Path) -> None:
        """Start the rig, plant faults until the time is over, end the rig."""
        config = load_rig(path)
        children = children_of(config, path, viewer=True, endpoint=[ENDPOINT])
        common = ("--config", str(path), "--connect", ENDPOINT)
        # One that records from the start on, in place of the one that waits for the page.
        children = [child for child in children if child.name != "recorder"]
        children.append(Child("recorder", service_argv("recorder", *common)))
        async with asyncio.TaskGroup() as tasks:
            keepers = [tasks.create_task(self._supervisor.keep_running(one)) for one in children]
            async with open_bus(config.rig.name, [ENDPOINT]) as bus:
                watch = tasks.create_task(self._watch(bus))
                await self._first_pose()
                sampler = tasks.create_task(self._sample())
                await self._plant(bus, path)
                for task in (watch, sampler, *keepers):
                    task.cancel()
        self.run.restarts = dict(self._supervisor.restarts)
        await asyncio.sleep(1.0)
        pids = self._supervisor.pids.values()
        self.run.left_over = sum(rss_mb(pid) is not None for pid in pids)

    async def _first_pose(self) -> None:
        self._began_s = time.monotonic()
        async with asyncio.timeout(FIRST_POSE_S):
            while self._last_pose_s == float("-inf"):
                await asyncio.sleep(0.1)
        self._began_s = time.monotonic()
        self.run.latencies.clear()

    async def _watch(self, bus: Bus) -> None:
        async for pose in bus.every(topics.POSE, 256):
            if any(finger.status == "predicted" for finger in pose.fingers):
                continue
            self._last_pose_s = self.now_s()
            latency_ms = (clock.now_ns() - pose.stamp_ns) * 1e-6
            self.run.latencies.append((self._last_pose_s, latency_ms))

    async def _sample(self) -> None:
        while True:
            for process, pid in self._supervisor.pids.items():
                if (megabytes := rss_mb(pid)) is not None:
                    samples = self.run.memory.setdefault((process, pid), [])
                    samples.append((self.now_s(), megabytes))
            await asyncio.sleep(SAMPLE_S)

    async def _plant(self, bus: Bus, path: Path) -> None:
        faults = Faults(bus, path, ENDPOINT, self._supervisor.pids, self._seed)
        pauses = random.Random(self._seed)
        while self.now_s() < LETHAL_SHARE * self.run.seconds:
            await asyncio.sleep(pauses.uniform(*PAUSE_S))
            await self._endure(*faults.pick_lethal())
        await self._warm_up(faults, pauses)
        while True:
            await asyncio.sleep(pauses.uniform(*PAUSE_S))
            if self.now_s() >= self.run.seconds:
                return
            await self._endure(*faults.pick())

    async def _warm_up(self, faults: Faults, pauses: random.Random) -> None:
        """Every fault that leaves processes alive, one soon after the other."""
        kinds = faults.every_kind()
        floods = [one for one in kinds if one[0] == PICTURES]
        planted = faults.every_stop() + WARM_UP_ROUNDS * kinds + WARM_UP_FLOODS * floods
        for name, fault in planted:
            await asyncio.sleep(pauses.uniform(*WARM_UP_PAUSE_S))
            print(f"{self.now_s():7.0f} s  to warm up: {name}", flush=True)
            await fault()
        await self._poses_again()
        self.run.warm_up_faults, self.run.warm_s = len(planted), self.now_s()
        print(f"{self.run.warm_s:7.0f} s  warmed up: memory counts from here", flush=True)

    async def _endure(self, name: str, fault: Fault) -> None:
        began_s = self.now_s()
        await fault()
        recovery = Recovery(began_s, name, await self._poses_again())
        self.run.recoveries.append(recovery)
        told = "never" if recovery.recovered_s is None else f"{recovery.recovered_s:.2f} s"
        print(f"{began_s:7.0f} s  {name}: poses again after {told}", flush=True)

    async def _poses_again(self) -> float | None:
        """How long until poses come steadily again: ten within one second."""
        began_s = self.now_s()
        while self.now_s() - began_s < GIVE_UP_S:
            recent = [at_s for at_s, _ in self.run.latencies[-10:]]
            if len(recent) == 10 and recent[0] >= began_s and recent[-1] - recent[0] < 1.0:
                return recent[0] - began_s
            await asyncio.sleep(0.02)
        return None


def main() -> None:
    """Run, report, exit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("soak"))
    options = parser.parse_args()
    soak = Soak(options.minutes * 60.0, options.seed)
    folder = Path(tempfile.mkdtemp(prefix="rhot-demo-"))
    try:
        with working_copy(folder / "rig") as path:
            # What a file's index takes until it is finished is no growth, either.
            with path.open("a", encoding="utf-8") as rig:
                rig.write("\n[recorder]\npart_minutes = 1\n")
            uvloop.run(soak.go(path))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    report = markdown(soak.run, f"benchmarks/soak.py --minutes {options.minutes:g}")
    options.out.with_suffix(".md").write_text(report, encoding="utf-8")
    samples = {f"{process} {pid}": rows for (process, pid), rows in soak.run.memory.items()}
    options.out.with_suffix(".json").write_text(json.dumps(samples), encoding="utf-8")
    plot(soak.run, options.out.with_suffix(".png"))
    print(report)
    sys.exit(1 if shortfalls(soak.run) else 0)


if __name__ == "__main__":
    main()
