"""Clocks of videos that were started by hand, found from markers. `python benchmarks/video_sync.py`

Points as two cameras see them, whose clocks have nothing in common: begun up to 8 s apart, adrift
by 60 ppm RMS. Motions of testing/families (12 s, seen by both for 10 s) and made-up ones of a
minute; 30 fps and .06 px unless said otherwise. [--tuning] for the half that constants were chosen
on, [--seeds N] of each motion, [--only FAULT], [--json FILE].

Printed for each fault: how many were decided, the largest error of the offset within what both saw
(ms: median, 95 %, largest), that of the drift (ppm), both in sigmas (RMS, largest), and the error
of the plain way: the lag of the largest correlation of all markers' mean heights, interpolated to
a parabola's top (ms: median, 95 %).
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import tempfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import msgspec
import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, rotation_x, rotation_y
from rhot.messages import MarkerFrame
from services.cli.offline.clocks.alignment import Clocks
from services.cli.offline.clocks.camera_clock import CameraClock
from services.cli.offline.clocks.recorded_markers import RecordedMarkers
from services.fusion.alignment.height_track import HeightTrack
from services.fusion.geometry.rectified_pair import rectified_pair
from testing.families.catalog import cases
from testing.families.motions import SampledMotion, open_hand_m, stop_and_go_path
from testing.synthetic_points import SIZE_PX, START_NS, Motion, MovingHand, SyntheticRig, frames
from testing.wrong_markers import with_correlated_errors, with_static_markers

RIG = SyntheticRig(clock_error_s=0.0, skew_s=0.0, drift_ppm=0.0, loss=0.02)
NAMES = ["left", "right"]
Fault = Callable[[list[MarkerFrame], int], list[MarkerFrame]]


def _missing(given: list[MarkerFrame], seed: int) -> list[MarkerFrame]:
    """A third of all markers are not found."""
    random = np.random.default_rng([seed, 1])
    return [
        msgspec.structs.replace(f, markers=[m for m in f.markers if random.random() > 0.33])
        for f in given
    ]


def _jumping(given: list[MarkerFrame], seed: int) -> list[MarkerFrame]:
    """A tenth of all markers are something else."""
    random = np.random.default_rng([seed, 2])
    found = []
    for frame in given:
        markers = []
        for marker in frame.markers:
            x, y = random.uniform((0.0, 0.0), (SIZE_PX[0] - 1.0, SIZE_PX[1] - 1.0)).tolist()
            wrong = random.random() < 0.1
            markers.append(msgspec.structs.replace(marker, x_px=x, y_px=y) if wrong else marker)
        found.append(msgspec.structs.replace(frame, markers=markers))
    return found


def _one(given: list[MarkerFrame], _: int) -> list[MarkerFrame]:
    """One marker alone."""
    return [
        msgspec.structs.replace(f, markers=[m for m in f.markers if m.color == "blue"])
        for f in given
    ]


def _wrong(given: list[MarkerFrame], seed: int) -> list[MarkerFrame]:
    """One camera sees something else for three seconds."""
    return with_static_markers(given, "right", (3.0, 6.0), frozen=False, seed=seed)


FAULTS: dict[str, tuple[SyntheticRig, Fault]] = {
    "clean": (RIG, lambda given, _: given),
    "lasting .3 px": (RIG, lambda given, seed: with_correlated_errors(given, 0.3, seed)),
    "lasting 1 px": (RIG, lambda given, seed: with_correlated_errors(given, 1.0, seed)),
    "a third missing": (RIG, _missing),
    "a tenth wrong": (RIG, _jumping),
    "3 s wrong": (RIG, _wrong),
    "one marker": (RIG, _one),
    "60 fps, .5 px": (dataclasses.replace(RIG, fps=60.0, sigma_px=0.5), lambda given, _: given),
    "15 fps": (dataclasses.replace(RIG, fps=15.0), lambda given, _: given),
    "bumped by .5 deg": (RIG, lambda given, _: given),
}


def minute(seed: int) -> Motion:
    """A minute of a hand that goes from place to place, or about in sinusoids."""
    if seed % 2:
        return MovingHand(distance_m=0.6, speed_m_s=0.3, hand_hz=(0.2, 1.5), seed=1000 + seed)
    times_s, path = stop_and_go_path(8.0, 1000 + seed, pause_s=0.6, seconds=64.0)
    return SampledMotion(times_s, open_hand_m(0.55) + path[:, None])


def recording(
    motion: Motion, seconds: float, fault: str, seed: int
) -> tuple[list[MarkerFrame], float, float]:
    """Frames by clocks without anything in common; by how much right's is late, and its drift."""
    random = np.random.default_rng([seed, 5])
    rig, spoil = FAULTS[fault]
    rig = dataclasses.replace(rig, seed=seed, phase_s=random.uniform(0.0, 1.0 / rig.fps))
    late_s, drift = random.uniform(-8.0, 8.0), random.normal(0.0, 60e-6)
    found = []
    for frame in spoil(frames(rig, motion, seconds), seed):
        time_s = (frame.stamp_ns - START_NS) * 1e-9
        if frame.camera == "right":
            if time_s < 0.17 * seconds:
                continue
            time_s = time_s * (1.0 + drift) + late_s
        elif time_s > 0.93 * seconds:
            continue
        stamp_ns = START_NS + round(1e9 * time_s)
        found.append(
            msgspec.structs.replace(frame, stamp_ns=stamp_ns, clock_offset_ns=0, clock_sigma_ns=-1)
        )
    return sorted(found, key=lambda frame: (frame.stamp_ns, frame.camera)), late_s, drift


def cameras_of(fault: str) -> dict[str, Camera]:
    """As calibrated: one was bumped since, or not."""
    found = RIG.rig()
    if fault.startswith("bumped"):
        T = found["right"].T_rig_from_camera.copy()
        T[:3, :3] = T[:3, :3] @ rotation_x(np.deg2rad(0.5)) @ rotation_y(np.deg2rad(0.3))
        found["right"] = dataclasses.replace(found["right"], T_rig_from_camera=T)
    return found


def plain_s(one: list[HeightTrack], other: list[HeightTrack]) -> float:
    """The lag of the largest correlation of mean heights, of +-60 s."""
    step_s = 0.01
    curves = []
    for tracks in (one, other):
        begin_s = min(track.times_s[0] for track in tracks)
        grid = np.arange(begin_s, max(track.times_s[-1] for track in tracks), step_s)
        mean = np.mean([np.interp(grid, track.times_s, track.heights) for track in tracks], axis=0)
        curves.append((begin_s, mean - mean.mean()))
    (a_s, a), (b_s, b) = curves
    n = len(a) + len(b)
    total = np.fft.irfft(np.fft.rfft(a, n).conj() * np.fft.rfft(b, n), n)
    lags = np.arange(n)
    lags[lags >= len(b)] -= n
    best = int(np.argmax(total))
    below, top, above = total[best - 1], total[best], total[(best + 1) % n]
    return (
        b_s - a_s + step_s * float(lags[best] + 0.5 * (below - above) / (below + above - 2 * top))
    )


def tried(
    motion: Motion, seconds: float, fault: str, seed: int
) -> tuple[CameraClock, Array, float]:
    """What is told of a recording, its errors (offset s, drift), and the plain way's error, s."""
    given, late_s, drift = recording(motion, seconds, fault, seed)
    cameras = cameras_of(fault)
    with (
        tempfile.TemporaryDirectory() as folder,
        closing(RecordedMarkers(Path(folder))) as recorded,
    ):
        for frame in given:
            recorded.add(frame)
        clocks = Clocks(recorded, NAMES)
        clocks.find(cameras, NAMES, {}, tune=True)
        pair = rectified_pair(cameras["left"], cameras["right"])
        assert pair is not None
        one = recorded.heights(cameras["left"], pair.R_rectified_from_first, START_NS)
        other = recorded.heights(cameras["right"], pair.R_rectified_from_second, START_NS)
        both = sorted(one.keys() & other.keys())
        begin_s = (recorded.span_ns("left")[0] - START_NS) * 1e-9
    told = clocks.told[0]
    plain = plain_s([one[color] for color in both], [other[color] for color in both])
    plain_error_s = abs(plain - late_s - drift * 0.55 * seconds)
    if told.offset_s is None or told.drift_ppm is None or told.at_s is None:
        return told, np.full(3, np.nan), plain_error_s
    wrong = told.drift_ppm * 1e-6 - drift
    at_s = begin_s + told.at_s
    middle = told.offset_s - late_s - drift * at_s
    ends = [middle + wrong * (end * seconds - at_s) for end in (0.17, 0.93)]
    return told, np.array([max(map(abs, ends)), middle, wrong]), plain_error_s


def main() -> int:
    """Run, print a table, and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the half constants were chosen on")
    parser.add_argument("--seeds", type=int, default=2, help="recordings of each motion")
    parser.add_argument("--only", choices=FAULTS, help="one fault")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half = "tuning" if options.tuning else "held_out"
    motions = {spec.name: (spec.build().truth, 12.0) for spec in cases(half, "points", "motion")}
    for n in range(6):
        motions[f"minute {n}"] = (minute(n + 100 * options.tuning), 60.0)
    results = {}
    print(
        f"{half}: {len(motions)} motions; decided | offset ms: median, 95 %, max | z: RMS, max | "
        "drift ppm: median, max | z | plain, ms: median, 95 %"
    )
    for fault in [options.only] if options.only else FAULTS:
        rows, plains, undecided = [], [], []
        for name, (motion, seconds) in motions.items():
            for seed in range(1, 1 + options.seeds):
                told, error, plain = tried(motion, seconds, fault, seed)
                plains.append(1e3 * plain)
                if not told.found or told.offset_sigma_s is None or told.drift_sigma_ppm is None:
                    undecided.append(f"{name}: {told.why_not}")
                    continue
                sigmas = (error[1] / told.offset_sigma_s, 1e6 * error[2] / told.drift_sigma_ppm)
                rows.append((name, 1e3 * error[0], *sigmas, 1e6 * abs(error[2])))
        results[fault] = figures(rows, plains, undecided)
        print_row(fault, results[fault], len(plains))
        worst = sorted(rows, key=lambda row: -row[1])[:3]
        print("    worst: " + ", ".join(f"{row[0]} {row[1]:.2f} ms" for row in worst))
        for text in sorted(set(undecided)):
            print(f"    undecided: {text}")
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


def figures(
    rows: list[tuple[str, float, float, float, float]], plains: list[float], undecided: list[str]
) -> dict[str, float]:
    """What is printed, of the decided recordings of one fault."""
    table = np.array([row[1:] for row in rows]).reshape(-1, 4)
    if not len(table):
        table = np.full((1, 4), np.nan)
    return {
        "decided": float(len(rows)),
        "undecided": float(len(undecided)),
        "median_ms": float(np.median(table[:, 0])),
        "p95_ms": float(np.percentile(table[:, 0], 95)),
        "max_ms": float(table[:, 0].max()),
        "z_rms": float(np.sqrt(np.mean(table[:, 1] ** 2))),
        "z_max": float(np.abs(table[:, 1]).max()),
        "drift_median_ppm": float(np.median(table[:, 3])),
        "drift_max_ppm": float(table[:, 3].max()),
        "drift_z_rms": float(np.sqrt(np.mean(table[:, 2] ** 2))),
        "drift_z_max": float(np.abs(table[:, 2]).max()),
        "plain_median_ms": float(np.median(plains)),
        "plain_p95_ms": float(np.percentile(plains, 95)),
    }


def print_row(fault: str, f: dict[str, float], total: int) -> None:
    """One line of the table."""
    print(
        f"{fault:18s}{f['decided']:4.0f}/{total} |{f['median_ms']:7.3f}{f['p95_ms']:7.3f}"
        f"{f['max_ms']:7.3f} |{f['z_rms']:5.2f}{f['z_max']:5.1f} |{f['drift_median_ppm']:7.1f}"
        f"{f['drift_max_ppm']:7.1f} |{f['drift_z_rms']:5.2f}{f['drift_z_max']:5.1f} |"
        f"{f['plain_median_ms']:9.2f}{f['plain_p95_ms']:9.1f}",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
