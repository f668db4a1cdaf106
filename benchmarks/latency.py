"""From a marker to a pose through real processes, beside three hops of bare Zenoh.

    python benchmarks/latency.py [--seconds 10] [--rates 30 60 90] [--json FILE]

`rhot-fusion --solve`, a router, and two relays that do nothing but put a payload of the same size,
each a process of its own. Two cameras' frames are put at the pace of their stamps, and half way to
the next frame a bare message takes three hops, one for each of markers, points and pose: whatever
else this machine does, it does to both. At 60 fps again with the solver in a process of its own
(three hops, as the bare message; one less where they share one), and without the router, each a
peer of the others. Latencies from the put of the frame whose instant the pose is of (fusion's lag
is 0) to the callback that has the pose:
    latency_ratio_p50   median of ours over the median of bare Zenoh, at 60 fps
    latency_p99_ms      of ours, at 60 fps
    ..._apart           the same with the solver in a process of its own
Where the time goes: `sent_ns` of points and poses splits it, in a run of its own, as whoever
listens to points takes time as well; steps, decoding and encoding alone are timed in this process
(step_us, medians of processor time; _over_fit: held against the compiled fit of a hand), a hop is a
third of the bare message, and what is left is waking up.
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
from latency_peer import peer_config
from latency_relay import NUMBER_BYTES
from latency_rig import BARE_KEYS, RIG, Recording, record, running
from latency_steps import alone_us

from rhot import topics
from rhot.bus.zenoh_config import client_config
from rhot.messages import HandPoints, HandPose, MarkerFrame

MAIN_FPS = 60.0
# From mid-exposure to the tracker's put: readout and the tracker's step.
TRACKER_S = 0.015
# Left out at the beginning: the first pose, the first challenges, caches.
WARM_S = 2.0
START_S = 60.0


class Played:
    """When frames were put (ns, by their stamp), and when what came of them was here."""

    def __init__(self, endpoint: str, recording: Recording, *, points: bool, direct: bool) -> None:
        self._recording = recording
        self._session = zenoh.open((peer_config if direct else client_config)([endpoint]))
        self.put_ns: dict[int, int] = {}  # by the frame's instant, which points due with it have
        self.due_ns: list[int] = []  # when frames were put that points are due with
        self.bare_put_ns: list[int] = []
        self.bare_ns: list[tuple[int, int]] = []
        self.pose_ns: list[tuple[int, bytes]] = []
        self.points: list[bytes] = []
        pose_key = topics.POSE.key(RIG, hand="right")
        self._session.declare_subscriber(pose_key, self._on_pose)
        self._session.declare_subscriber(BARE_KEYS[2], self._on_bare)
        if points:
            self._session.declare_subscriber(
                topics.POINTS.key(RIG, hand="right"),
                lambda sample: self.points.append(sample.payload.to_bytes()),
            )
        self._markers = {name: self._publisher(name) for name in recording.rig.names}
        self._bare = self._session.declare_publisher(
            BARE_KEYS[0], priority=zenoh.Priority.REAL_TIME, express=True
        )

    def _publisher(self, camera: str) -> zenoh.Publisher:
        return self._session.declare_publisher(
            topics.MARKERS.key(RIG, camera=camera),
            priority=zenoh.Priority.REAL_TIME,
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
        )

    def _on_pose(self, sample: zenoh.Sample) -> None:
        self.pose_ns.append((time.time_ns(), sample.payload.to_bytes()))

    def _on_bare(self, sample: zenoh.Sample) -> None:
        number = int.from_bytes(sample.payload.to_bytes()[:NUMBER_BYTES])
        self.bare_ns.append((time.time_ns(), number))

    def play(self) -> None:
        """Put all frames at their pace, and a bare message after each that points are due with."""
        deadline_s = time.monotonic() + START_S
        waiting = [*self._markers.values(), self._bare]
        while not all(_is_heard(one) for one in waiting):
            if time.monotonic() > deadline_s:
                raise SystemExit("fusion, the solver or a relay did not start")
            time.sleep(0.05)
        time.sleep(1.0)
        bare = self._recording.example[0]
        shift_ns = time.time_ns() + 100_000_000 - self._recording.frames[0].stamp_ns
        half_s = 0.25 / self._recording.rig.fps
        for frame, points in zip(self._recording.frames, self._recording.points, strict=True):
            stamp_ns = frame.stamp_ns + shift_ns
            sleep_until(stamp_ns * 1e-9 + TRACKER_S)
            message = msgspec.structs.replace(frame, stamp_ns=stamp_ns, sent_ns=time.time_ns())
            payload = msgspec.json.encode(message)
            self.put_ns[instant_ns(message)] = time.time_ns()
            if points is not None:
                self.due_ns.append(time.time_ns())
            self._markers[frame.camera].put(payload)
            if points is not None:
                sleep_until(stamp_ns * 1e-9 + TRACKER_S + half_s)
                numbered = len(self.bare_put_ns).to_bytes(NUMBER_BYTES) + bare
                self.bare_put_ns.append(time.time_ns())
                self._bare.put(numbered)
        time.sleep(0.5)
        self._session.close()

    def figures(self) -> dict[str, Any]:
        """Latencies in ms of poses and of bare messages, after the warm-up."""
        first_ns = min(self.put_ns.values()) + round(WARM_S * 1e9)
        ours = []
        for received_ns, payload in self.pose_ns:
            put_ns = self._due_with(msgspec.json.decode(payload, type=HandPose))
            if put_ns >= first_ns:
                ours.append((received_ns - put_ns) * 1e-6)
        bare = [
            (received_ns - self.bare_put_ns[number]) * 1e-6
            for received_ns, number in self.bare_ns
            if self.bare_put_ns[number] >= first_ns
        ]
        due = sum(put_ns >= first_ns for put_ns in self.due_ns)
        return {"ours": quantiles(ours), "bare": quantiles(bare), "poses": len(ours), "due": due}

    def _due_with(self, pose: HandPose) -> int:
        """When the frame was put that a pose was due with; 0 if none was.

        Its stamp is off by what fusion has learned of that camera's clock.
        """
        stamps_ns = np.array(list(self.put_ns))
        nearest = int(np.abs(stamps_ns - pose.stamp_ns).argmin())
        near = abs(int(stamps_ns[nearest]) - pose.stamp_ns) < 1_000_000
        return self.put_ns[int(stamps_ns[nearest])] if near else 0

    def split_us(self) -> dict[str, float]:
        """Medians: put to points sent, to the pose sent, to the pose here."""
        sent_ns = {
            points.stamp_ns: points.sent_ns
            for points in (msgspec.json.decode(one, type=HandPoints) for one in self.points)
        }
        parts = []
        for received_ns, payload in self.pose_ns[60:]:
            pose = msgspec.json.decode(payload, type=HandPose)
            put_ns, points_ns = self._due_with(pose), sent_ns.get(pose.stamp_ns, 0)
            if put_ns > 0 and points_ns > 0:
                parts.append(np.diff([put_ns, points_ns, pose.sent_ns, received_ns]) * 1e-3)
        names = ("put_to_points_us", "points_to_pose_us", "pose_to_here_us")
        return dict(zip(names, np.median(parts, axis=0).tolist(), strict=True))


def instant_ns(frame: MarkerFrame) -> int:
    """The frame's own instant, that of its middle row."""
    middle_ns = round(0.5 * (frame.size_px[1] - 1) * frame.row_time_ns)
    return frame.stamp_ns + middle_ns - frame.clock_offset_ns


def _is_heard(publisher: zenoh.Publisher) -> bool:
    # The stub says bool.
    return bool(publisher.matching_status.matching)  # type: ignore[attr-defined]


def sleep_until(instant_s: float) -> None:
    """Sleep until an instant of the real-time clock."""
    left_s = instant_s - time.time()
    if left_s > 0.0:
        time.sleep(left_s)


def quantiles(values: list[float]) -> dict[str, float]:
    """p50, p95, p99 and the maximum."""
    p50, p95, p99, most = np.percentile(values, [50.0, 95.0, 99.0, 100.0]).tolist()
    return {"p50": p50, "p95": p95, "p99": p99, "max": most}


def measure(fps: float, seconds: float) -> dict[str, Any]:
    """One rate: latencies, then where they come from."""
    recording = record(fps, seconds + WARM_S)
    found = played(recording).figures()
    if fps == MAIN_FPS:
        found["apart"] = played(recording, apart=True).figures()
        found["direct"] = played(recording, direct=True).figures()
        found["split"] = played(recording, points=True).split_us()
        found["alone"] = alone_us(recording)
        found["stages_us"] = dict(stages(found))
    return found


def played(
    recording: Recording, *, points: bool = False, apart: bool = False, direct: bool = False
) -> Played:
    """A recording, played to processes of its own; points: listening to those as well."""
    with (
        tempfile.TemporaryDirectory() as folder,
        running(Path(folder), recording, apart=apart, direct=direct) as endpoint,
    ):
        run = Played(endpoint, recording, points=points, direct=direct)
        run.play()
    return run


def stages(found: dict[str, Any]) -> list[tuple[str, float]]:
    """Where the median goes, in us: what is timed alone, the hops, and what is left."""
    split, alone = found["split"], found["alone"]
    hop = found["bare"]["p50"] * 1e3 / 3.0
    fusion = alone["decode_markers"] + alone["fusion_telling"]
    solver = alone["encode_points"] + alone["decode_points"] + alone["solver"]
    return [
        ("two hops of bare Zenoh", 2.0 * hop),
        ("fusion, decode markers", alone["decode_markers"]),
        ("fusion, step that tells points", alone["fusion_telling"]),
        ("fusion, wake up, and the rest", split["put_to_points_us"] - hop - fusion),
        ("fusion, encode points", alone["encode_points"]),
        ("solver, decode points", alone["decode_points"]),
        ("solver, step", alone["solver"]),
        ("solver, wake up, and the rest", split["points_to_pose_us"] - solver),
        ("solver, encode the pose", alone["encode_pose"]),
        ("pose here, the rest", split["pose_to_here_us"] - hop - alone["encode_pose"]),
    ]


def print_table(results: dict[float, dict[str, Any]]) -> None:
    """Latencies of all rates, then the stages."""
    print(f"{'2 cameras':<24} {'p50':>8} {'95 %':>8} {'p99':>8} {'max':>8}  ms")
    for fps, found in results.items():
        print_way(f"{fps:3.0f} fps", found)
        for way in ("apart", "direct"):
            if way in found:
                print_way(way, found[way])
    for found in results.values():
        if "split" in found:
            print("\nwhere the median goes at 60 fps, us")
            for name, value in found["stages_us"].items():
                print(f"  {name:<34} {value:7.0f}")
            alone = found["alone"]
            print(f"  {'fusion, step that tells none':<34} {alone['fusion_silent']:7.0f}")


def print_way(title: str, found: dict[str, Any]) -> None:
    """Latencies of one run."""
    for name, row in (("marker to pose", found["ours"]), ("bare Zenoh", found["bare"])):
        told = " ".join(f"{value:8.3f}" for value in row.values())
        print(f"{title:<7} {name:<16} {told}")
    ratio = found["ours"]["p50"] / found["bare"]["p50"]
    print(f"        ratio {ratio:12.2f}, {found['poses']} of {found['due']} poses")


def main() -> None:
    """Measure all rates and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rates", type=float, nargs="+", default=[30.0, MAIN_FPS, 90.0])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    # What a time limit ends must end its processes.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    results = {fps: measure(fps, options.seconds) for fps in options.rates}
    print_table(results)
    summary: dict[str, Any] = {f"fps_{fps:.0f}": found for fps, found in results.items()}
    if MAIN_FPS in results:
        main_rate = results[MAIN_FPS]
        for name, found in (("", main_rate), ("_apart", main_rate["apart"])):
            ratio = found["ours"]["p50"] / found["bare"]["p50"]
            summary[f"latency_ratio_p50{name}"] = ratio
            summary[f"latency_p99_ms{name}"] = found["ours"]["p99"]
            print(f"latency_ratio_p50{name} {ratio:.2f}", end="")
            print(f"   latency_p99_ms{name} {found['ours']['p99']:.2f}")
        summary["step_us"] = main_rate["alone"]
    if options.json:
        options.json.write_text(json.dumps(summary, indent=1) + "\n")


if __name__ == "__main__":
    main()
