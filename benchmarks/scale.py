"""Many rigs on one machine: one fusion, which solves as well, for all of them.

    python benchmarks/scale.py [--rigs 1 4 16 32 64] [--fps 30 60] [--routers 1 2] [--seconds 10]
                               [--one-process] [--apart] [--json FILE]

Real processes: routers (two are joined, with half of the rigs each), `rhot-fusion --solve` with a
folder of rig.toml files (--one-process: in one, also where it would take several; --apart: without
--solve, and rhot-solver beside it). Two cameras' markers of every rig are put at the pace of their
stamps, no two rigs in step. Of each combination:
    poses      share of the poses that are due (a replay of the same frames tells how many) and
               came
    p50, p99   ms from the put of the frame that a pose is due with to the callback that has it
    core       processor time of routers, and of fusion and solver, as shares of one core
    us/frame   the same for each frame of markers
    MB         memory of fusion and solver together, and by how much each further rig adds to it
    offered    frames that were put, of those that should have been: less than 1 means that this
               program itself did not find the time
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import zenoh
from latency import WARM_S, sleep_until
from latency_rig import Recording, record
from scale_rigs import Machine, rig_name, running

from rhot import topics
from rhot.bus.zenoh_config import client_config
from rhot.messages import HandPose, MarkerFrame
from rhot.messages.health import Health

# A frame is put this long after its stamp.
TRACKER_S = 0.015
SERVICES = ("fusion", "solver")
# Frames are put late by no more than this, or not at all: what comes of them would be refused.
LATEST_S = 0.25


class Feed:
    """All rigs' frames put at their pace; what came of them, and when."""

    def __init__(self, endpoints: list[str], recording: Recording, rigs: int) -> None:
        self._recording = recording
        self._sessions = [zenoh.open(client_config([one])) for one in endpoints]
        self._publishers = [
            {camera: self._publisher(n, camera) for camera in recording.rig.names}
            for n in range(rigs)
        ]
        self._poses: list[tuple[int, int, bytes]] = []  # rig, ns, payload
        self._running: set[str] = set()
        for n in range(rigs):
            key = topics.POSE.key(rig_name(n), hand="right")
            # The other router's, where there are two: poses cross between them.
            self._sessions[-1 - n % len(self._sessions)].declare_subscriber(key, self._taker(n))
            for name in SERVICES:
                key = topics.HEALTH.key(rig_name(n), service=name, instance="main")
                self._sessions[0].declare_subscriber(key, self._note_health)
        self.offered = 0
        # Put at (ns) by rig and instant of a frame. Of all cameras: where a frame of the reference
        # was late, fusion goes on with another, and poses have that one's instants.
        self._put_ns: list[dict[int, int]] = [{} for _ in range(rigs)]
        # Of each rig, when frames were put that a replay tells points with.
        self._due_ns: list[list[int]] = [[] for _ in range(rigs)]

    def _publisher(self, n: int, camera: str) -> zenoh.Publisher:
        return self._sessions[n % len(self._sessions)].declare_publisher(
            topics.MARKERS.key(rig_name(n), camera=camera),
            priority=zenoh.Priority.REAL_TIME,
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
        )

    def _taker(self, n: int) -> Any:
        return lambda sample: self._poses.append((n, time.time_ns(), sample.payload.to_bytes()))

    def _note_health(self, sample: zenoh.Sample) -> None:
        # A service beats while it still compiles.
        if msgspec.json.decode(sample.payload.to_bytes(), type=Health).state == "running":
            self._running.add(str(sample.key_expr))

    def wait(self, seconds: float) -> None:
        """Until fusion and solver of all rigs say that they run."""
        deadline_s = time.monotonic() + seconds
        wanted = {
            topics.HEALTH.key(rig_name(n), service=name, instance="main")
            for n in range(len(self._publishers))
            for name in SERVICES
        }
        while not wanted <= self._running:
            if time.monotonic() > deadline_s:
                raise SystemExit(f"these do not run: {', '.join(sorted(wanted - self._running))}")
            time.sleep(0.2)

    def play(self) -> None:
        """Put all frames; each rig begins at its own instant within a frame."""
        frames, rigs = self._recording.frames, len(self._publishers)
        began_ns = time.time_ns() + 200_000_000
        period_ns = 1e9 / self._recording.rig.fps
        offsets_ns = np.random.default_rng(1).permutation(rigs) / rigs * period_ns
        shifts_ns = [began_ns - frames[0].stamp_ns + round(one) for one in offsets_ns]
        due = sorted(
            (frame.stamp_ns + shift_ns, n, k)
            for n, shift_ns in enumerate(shifts_ns)
            for k, frame in enumerate(frames)
        )
        for stamp_ns, n, k in due:
            sleep_until(stamp_ns * 1e-9 + TRACKER_S)
            now_ns = time.time_ns()
            if now_ns - stamp_ns > (TRACKER_S + LATEST_S) * 1e9:
                continue
            self._put_ns[n][instant_ns(frames[k]) + shifts_ns[n]] = now_ns
            if self._recording.points[k] is not None:
                self._due_ns[n].append(now_ns)
            message = msgspec.structs.replace(frames[k], stamp_ns=stamp_ns, sent_ns=now_ns)
            self._publishers[n][message.camera].put(msgspec.json.encode(message))
            self.offered += 1
        time.sleep(1.0)
        for session in self._sessions:
            session.close()

    def figures(self) -> dict[str, float]:
        """Shares and ms, after the warm-up."""
        first_ns = min(min(own.values()) for own in self._put_ns) + round(WARM_S * 1e9)
        stamps = [np.array(sorted(own)) for own in self._put_ns]
        took_ms, came = [], set()
        for n, received_ns, payload in self._poses:
            pose = msgspec.json.decode(payload, type=HandPose)
            nearest = int(stamps[n][np.abs(stamps[n] - pose.stamp_ns).argmin()])
            put_ns = self._put_ns[n][nearest]
            # Off by nanoseconds, where the present is another epoch than the recording's.
            if abs(nearest - pose.stamp_ns) < 1_000_000 and put_ns >= first_ns:
                took_ms.append((received_ns - put_ns) * 1e-6)
                came.add((n, nearest))
        due = sum(put_ns >= first_ns for own in self._due_ns for put_ns in own)
        p50, p95, p99, most = np.percentile(took_ms, [50.0, 95.0, 99.0, 100.0]).tolist()
        return {
            "poses": min(len(came) / due, 1.0),
            "p50_ms": p50,
            "p95_ms": p95,
            "p99_ms": p99,
            "max_ms": most,
            "offered": self.offered / (len(self._put_ns) * len(self._recording.frames)),
        }


def instant_ns(frame: MarkerFrame) -> int:
    """The instant that fusion gives the points of a frame: its middle row's."""
    return frame.stamp_ns + round(0.5 * (frame.size_px[1] - 1) * frame.row_time_ns)


def measure(
    recording: Recording, rigs: int, routers: int, *, one_process: bool, apart: bool
) -> dict[str, float]:
    """One combination."""
    how = {"one_process": one_process, "apart": apart}
    with (
        tempfile.TemporaryDirectory() as folder,
        running(Path(folder), recording.rig, rigs, routers, **how) as machine,
    ):
        feed = Feed(machine.endpoints, recording, rigs)
        feed.wait(60.0 + 2.0 * rigs)
        time.sleep(2.0)
        machine.begin()
        feed.play()
        return {**feed.figures(), **used(machine, feed.offered)}


def used(machine: Machine, frames: int) -> dict[str, float]:
    """Shares of a core, processor time a frame and memory, since machine.begin()."""
    cores = machine.cores()
    found = {f"{name}_core": share for name, share in cores.items()}
    found["us_per_frame"] = machine.elapsed_s() * sum(cores.values()) / frames * 1e6
    found["memory_mb"] = machine.memory_mb("services")
    return found


def show(fps: float, routers: int, rigs: int, found: dict[str, float]) -> str:
    """A row of the table."""
    cores = " ".join(f"{found[f'{name}_core']:5.2f}" for name in ("router", "services"))
    return (
        f"{fps:4.0f} {routers:7d} {rigs:5d} {100.0 * found['poses']:7.2f} {found['p50_ms']:6.2f} "
        f"{found['p99_ms']:7.2f} {found['max_ms']:7.1f}  {cores} {found['us_per_frame']:8.0f} "
        f"{found['memory_mb']:7.0f} {found['mb_per_rig']:7.1f} {found['offered']:7.3f}"
    )


def main() -> None:
    """Measure all combinations and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, nargs="+", default=[1, 4, 16, 32, 64])
    parser.add_argument("--fps", type=float, nargs="+", default=[30.0, 60.0])
    parser.add_argument("--routers", type=int, nargs="+", choices=(1, 2), default=[1, 2])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--one-process", action="store_true")
    parser.add_argument("--apart", action="store_true")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    # What a time limit ends must end its processes.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    print(
        f"{'fps':>4} {'routers':>7} {'rigs':>5} {'poses %':>7} {'p50 ms':>6} {'p99':>7} {'max':>7}"
        f"  {'router both':>11} {'us/frame':>8} {'MB':>4} {'MB/rig':>7} "
        f"{'offered':>7}"
    )
    results: dict[str, dict[str, dict[str, dict[str, float]]]] = {}
    for fps in options.fps:
        recording = record(fps, options.seconds + WARM_S)
        for routers in options.routers:
            first: tuple[int, float] | None = None
            for rigs in options.rigs:
                if rigs < routers:
                    continue
                how = {"one_process": options.one_process, "apart": options.apart}
                found = measure(recording, rigs, routers, **how)
                first = first or (rigs, found["memory_mb"])
                more = max(rigs - first[0], 1)
                found["mb_per_rig"] = (found["memory_mb"] - first[1]) / more
                print(show(fps, routers, rigs, found), flush=True)
                of_fps = results.setdefault(f"fps_{fps:.0f}", {})
                of_fps.setdefault(f"routers_{routers}", {})[f"rigs_{rigs}"] = found
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
