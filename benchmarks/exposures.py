"""What it costs, without lag, that cameras expose at different instants, and that frames are late.

    RHOT_DATA=FOLDER python benchmarks/exposures.py [--tuning] [--json FILE]

The motions of testing/families, points alone, of two cameras that take 30 pictures a second; the
second exposes so many ms after the first. Frames come in the order of their exposures, or each so
late as an exponential distribution says (5 ms on average; those of a camera in their order). In mm
at lag 0, over landmarks that both cameras see: RMS, 95 % and maximum, and of the instants that the
first camera has the share (per cent) with points; `plain`: points are told at each frame of the
first camera. old: how old what a camera saw last is as points are told, the older of both, ms;
waits: how long they wait for the other camera's frame, 95 %, ms.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path
from unittest.mock import patch

import numpy as np
from held_out_score import END_S, WARM_S, make_fusion, told_in
from one_camera import motions

from rhot.geometry.transforms import Array
from rhot.messages import HandPoints, MarkerFrame
from services.fusion.step import FusionStep
from testing.families.case import Case, Half
from testing.families.points import point_case
from testing.synthetic_points import SIZE_PX, START_NS, Motion, SyntheticRig

APART_MS = (0.0, 3.0, 6.0, 10.0, 16.7, 25.0, 30.0)
LATE_MS = (0.0, 5.0)
Figures = dict[str, float]


class FirstCamera:
    """A schedule without any thought: points at each frame of the first camera, as it comes."""

    def __init__(self, _fps: Array, _lag_frames: int) -> None: ...

    def add_frame(self, camera: int, instant_ns: int) -> list[int]:
        """The frame's own instant, if it is the first camera's."""
        return [instant_ns] if camera == 0 else []

    def take_waiting(self) -> list[int]:
        """None ever wait."""
        return []


def arrivals_s(case: Case, late_ms: float) -> Array:
    """When frames (n,) come: in order of each camera, as late after their exposure as is drawn."""
    random = np.random.default_rng(1)
    come_s = np.array([middle_s(frame) for frame in case.frames])
    come_s += random.exponential(1e-3 * late_ms, len(come_s)) if late_ms else 0.0
    for camera in case.cameras:
        own = [n for n, frame in enumerate(case.frames) if frame.camera == camera]
        come_s[own] = np.maximum.accumulate(come_s[own])
    return come_s


def middle_s(frame: MarkerFrame) -> float:
    """When a frame's middle row was exposed, s since a case begins: the instant of its points."""
    middle_ns = round(0.5 * SIZE_PX[1] * frame.row_time_ns)
    return (frame.stamp_ns - frame.clock_offset_ns + middle_ns - START_NS) * 1e-9


def told(
    case: Case, fusion: FusionStep, come_s: Array
) -> tuple[list[HandPoints], list[float], list[float]]:
    """Points as frames come; how old, at each, what either camera saw last is, and its wait; s."""
    messages: list[HandPoints] = []
    old_s, waits_s = [], []
    newest_s: dict[str, float] = {}
    came_s: dict[float, float] = {}
    for n in np.argsort(come_s, kind="stable").tolist():
        frame: MarkerFrame = case.frames[n]
        exposed_s = middle_s(frame)
        newest_s[frame.camera] = max(exposed_s, newest_s.get(frame.camera, exposed_s))
        came_s[exposed_s] = come_s[n]
        for points in fusion.step(frame):
            messages.append(points)
            stamp_s = (points.stamp_ns - START_NS) * 1e-9
            at_s = min(came_s, key=lambda exposed_s: abs(exposed_s - stamp_s))
            old_s.append(at_s - min(newest_s.values()))
            waits_s.append(come_s[n] - came_s[at_s])
    return messages, old_s, waits_s


def figures_of(cases: list[Case], late_ms: float) -> Figures:
    """Over all cases, as fusion is."""
    errors_mm, old_s, waits_s = [], [], []
    instants = expected = 0
    for case in cases:
        messages, old, waits = told(case, make_fusion(case, 0), arrivals_s(case, late_ms))
        found = told_in(messages, case)
        lengths_mm = 1e3 * np.linalg.norm(found.points_m - case.truth(found.instants_s), axis=2)
        seen = lengths_mm[case.seen(found.instants_s)]
        errors_mm.append(seen[np.isfinite(seen)])
        old_s += old
        waits_s += waits
        instants += len(found.instants_s)
        first = next(iter(case.cameras))
        expected += sum(
            WARM_S <= middle_s(frame) <= case.seconds - END_S
            for frame in case.frames
            if frame.camera == first
        )
    every = np.concatenate(errors_mm)
    values = {
        "rms": np.sqrt(np.mean(every**2)),
        "p95": np.percentile(every, 95.0),
        "max": every.max(),
        "share": 100.0 * instants / expected,
        "old": 1e3 * np.mean(old_s),
        "waits": 1e3 * np.percentile(waits_s, 95.0),
    }
    return {name: round(float(value), 3) for name, value in values.items()}


def cases_apart(half: Half, apart_ms: float) -> list[Case]:
    """The motions of a half, seen by cameras that expose so long one after the other."""
    rig = dataclasses.replace(SyntheticRig(), phase_s=1e-3 * apart_ms)
    moved: dict[str, Motion] = motions(half)
    return [point_case(name, motion, rig) for name, motion in moved.items()]


def half_and_file(description: str | None) -> tuple[Half, Path | None]:
    """Which half to measure, and where to write the figures, by the command line."""
    parser = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the half that is no evidence")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    return ("tuning" if options.tuning else "held_out"), options.json


def main() -> None:
    """Print a row for each way to expose, and write them."""
    half, file = half_and_file(__doc__)
    columns = ("rms", "p95", "max", "share", "old", "waits")
    table: dict[str, dict[str, dict[str, Figures]]] = {}
    for late_ms in LATE_MS:
        print(f"\n{half}: frames {late_ms:g} ms late{'':10}rhot{'':41}plain")
        print(f"{'ms apart':10}" + 2 * "".join(f"{name:>8}" for name in columns))
        rows = table[f"{late_ms:g}"] = {}
        for apart_ms in APART_MS:
            cases = cases_apart(half, apart_ms)
            row = {"rhot": figures_of(cases, late_ms)}
            with patch("services.fusion.step.OutputSchedule", FirstCamera):
                row["plain"] = figures_of(cases, late_ms)
            rows[f"{apart_ms:g}"] = row
            values = [row[way][name] for way in ("rhot", "plain") for name in columns]
            print(f"{apart_ms:<10g}" + "".join(f"{value:8.2f}" for value in values), flush=True)
    if file:
        file.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
