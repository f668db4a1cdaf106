"""Which dot of one colour is which? `python benchmarks/dots.py [--json FILE] [--clips N]`

`--dots 8 --recording grab --first-seed 200 --clips 24` looks at other sides of one recording.

Joints of real hands (Leap at 110 Hz, played at 30 Hz; $RHOT_DATA) in front of a camera that looks
from anywhere: fingers hide dots, dots that touch run into one blob, some are not found, some that
are found are none. 8 dots are on thumb and index finger, 15 on the three outer joints of all
fingers. Seeds are given, as by clicks. Reported, of the dots of which a third shows or more: the
share that is right (within 1.3 radii), lost, another's, or elsewhere; and the longest exchange of
names. Beside the tracker of dots: each dot takes the nearest blob, and the optimal assignment of
all dots to blobs within 60 px. Live, each picture is told as it comes; with hindsight, as `rhot
track` does it, all of a clip are known before the first is told. Constants of motion were chosen on
`grab` with even seeds of 0 to 4, how blobs are cut and the ways of hindsight on 8 dots with seeds 0
to 29 and on 15 dots with seeds 0 to 3; here are other seeds and other recordings.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as rhot has it, before numpy is loaded

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS
from services.pi_tracker.dots.assignment import Indices, assign
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.dot import Patch, SeenPatches
from services.pi_tracker.dots.hindsight.looking_back import look_back
from services.pi_tracker.dots.tracker import DotTracker
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints
from testing.dot_patches import patches_of
from testing.synthetic_dots import DotFrame, dot_frames, scene_of

DATA = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
RECORDINGS = {"grab": "grab", "splay": "HandSplay-110fps", "pinch": "pinch", "wave": "wave"}
DOTS = {
    8: tuple((digit, joint) for digit in (0, 1) for joint in range(4)),
    15: tuple((digit, joint) for digit in range(5) for joint in (1, 2, 3)),
}
SIZE_PX, FPS, FIRST_SEED = (1280, 720), 30.0, 100
# A plain method takes no blob that is further than this from where a dot was.
REACH_PX = 60.0

Seeds = dict[str, tuple[float, float]]
# Where each dot is, by landmark; None or missing: not seen.
Told = Mapping[str, tuple[float, float] | None]
# That, of a frame and its time.
Method = Callable[[DotFrame, float], Told]


def ours(names: list[str], seeds: Seeds, _: list[DotFrame]) -> Method:
    """The tracker of dots, live."""
    tracker = DotTracker(names, SIZE_PX, seeds)

    def step(frame: DotFrame, time_s: float) -> dict[str, tuple[float, float] | None]:
        dots = tracker.step(patches_of(frame, tracker.dot_area_px2), time_s)
        return {
            name: None if dot.state == "carried" else (dot.x_px, dot.y_px)
            for name, dot in dots.items()
        }

    return step


def moved_to_nearest(last: Array, patches: Sequence[Patch], *, optimal: bool) -> Indices:
    """The patch of each dot (n,), -1 for none, of least distance to `last` (n, 2), px, which moves.

    optimal: of all dots at once; else each takes its nearest.
    """
    places = np.array([(p.x_px, p.y_px) for p in patches]).reshape(-1, 2)
    apart = np.linalg.norm(last[:, None] - places[None], axis=2)
    gains = np.where(apart < REACH_PX, 1e3 - apart, -np.inf)
    if optimal:
        found = assign(gains)
    else:
        found = np.array([int(r.argmax()) if (r > 0.0).any() else -1 for r in gains])
    last[found >= 0] = places[found[found >= 0]]
    return found


def plain(optimal: bool) -> Make:
    """Nearest blobs: each dot's own, or the optimal assignment."""

    def made(names: list[str], seeds: Seeds, _: list[DotFrame]) -> Method:
        last = np.array([seeds[name] for name in names])

        def step(frame: DotFrame, _: float) -> dict[str, tuple[float, float] | None]:
            seen = moved_to_nearest(last, patches_of(frame, 0.0), optimal=optimal) >= 0
            return {
                name: (float(last[k, 0]), float(last[k, 1])) if seen[k] else None
                for k, name in enumerate(names)
            }

        return step

    return made


def hindsight(names: list[str], seeds: Seeds, frames: list[DotFrame]) -> Method:
    """The dots of a whole clip, told one after the other."""
    live = DotTracker(names, SIZE_PX, seeds)
    pictures = []
    for number, frame in enumerate(frames):
        found = patches_of(frame, live.dot_area_px2)
        pictures.append(SeenPatches(number / FPS, found))
        live.step(found, number / FPS)
    told = look_back(
        lambda search: DotTracker(names, SIZE_PX, seeds, search, remembers=True), pictures
    )

    def step(_: DotFrame, time_s: float) -> dict[str, tuple[float, float] | None]:
        dots = told[round(time_s * FPS)]
        return {name: (dots[name].x_px, dots[name].y_px) for name in names if name in dots}

    return step


Make = Callable[[list[str], Seeds, list[DotFrame]], Method]
METHODS: dict[str, Make] = {
    "nearest blob": plain(False),
    "optimal assignment": plain(True),
    "rhot": ours,
    "rhot, with hindsight": hindsight,
}


class Shown(Protocol):
    """A picture of n dots: places (n, 2) px, visible shares (n,), their mean radius, px."""

    @property
    def places(self) -> Array: ...
    @property
    def visible(self) -> Array: ...
    @property
    def radius(self) -> float: ...


def judge(frames: Sequence[Shown], names: list[str], told: Sequence[Told]) -> dict[str, int]:
    """Counts of visible dots, and the longest exchange of names in frames."""
    counts = dict.fromkeys(("dots", "right", "lost", "exchanged", "elsewhere", "longest"), 0)
    running = np.zeros(len(names), np.int64)
    for frame, own in zip(frames, told, strict=True):
        near = max(10.0, 1.3 * frame.radius)
        for k, name in enumerate(names):
            place, truth = own.get(name), frame.places[k]
            apart = np.full(len(names), np.inf)
            if place is not None:
                apart = np.linalg.norm(frame.places - np.array(place), axis=1)
            exchanged = bool(apart[k] > near and apart.min() <= near)
            running[k] = running[k] + 1 if exchanged else 0
            counts["longest"] = max(counts["longest"], int(running[k]))
            inside = (truth > 4.0).all() and (truth < np.array(SIZE_PX) - 4.0).all()
            if frame.visible[k] > 0.35 and inside:
                counts["dots"] += 1
                kind = "lost" if place is None else "right" if apart[k] <= near else "elsewhere"
                counts["exchanged" if exchanged else kind] += 1
    return counts


def clip(recorded: RecordedJoints, dots: int, seed: int) -> list[DotFrame]:
    """160 frames of a recording from a random side."""
    return dot_frames(scene_of(recorded, DOTS[dots], SIZE_PX, FPS, seed), seed)


def run(
    recorded: dict[str, RecordedJoints], dots: int, clips: int, first_seed: int = FIRST_SEED
) -> list[dict[str, Any]]:
    """A row for each recording and method."""
    names = [finger_landmarks(DIGITS[digit])[joint] for digit, joint in DOTS[dots]]
    rows = []
    for name, one in recorded.items():
        films = [clip(one, dots, first_seed + k) for k in range(clips)]
        for method, make in METHODS.items():
            total: dict[str, int] = {}
            started = time.perf_counter()
            for film in films:
                places = film[0].places + np.random.default_rng(1).normal(0.0, 2.0, (len(names), 2))
                seeds = {n: (float(x), float(y)) for n, (x, y) in zip(names, places, strict=True)}
                follow = make(names, seeds, film)
                told = [follow(frame, number / FPS) for number, frame in enumerate(film)]
                counts = judge(film, names, told)
                longest = max(total.get("longest", 0), counts["longest"])
                total = {key: total.get(key, 0) + value for key, value in counts.items()}
                total["longest"] = longest
            took_ms = 1e3 * (time.perf_counter() - started) / sum(map(len, films))
            rows.append({"dots on": dots, "recording": name, "method": method} | total)
            rows[-1]["ms a frame"] = round(took_ms, 1)
    return rows


def show(row: dict[str, Any]) -> str:
    """One line of the table."""
    shares = "".join(
        f"{100.0 * row[key] / row['dots']:11.2f}"
        for key in ("right", "lost", "exchanged", "elsewhere")
    )
    return (
        f"{row['dots on']:4d}  {row['recording']:10s}{row['method']:22s}{shares}"
        f"{row['longest']:10d}{row['ms a frame']:9.1f}"
    )


def figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Rows by dots, recording and method."""
    found: dict[str, Any] = {}
    for row in rows:
        of_recording = found.setdefault(str(row["dots on"]), {}).setdefault(row["recording"], {})
        of_recording[row["method"]] = {
            "right_percent": round(100.0 * row["right"] / row["dots"], 2),
            "longest_exchange_frames": row["longest"],
            "ms_a_frame": row["ms a frame"],
        }
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    parser.add_argument("--clips", type=int, default=6, help="of each recording")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="of the clips")
    parser.add_argument("--dots", type=int, choices=DOTS, help="only so many")
    parser.add_argument("--recording", choices=RECORDINGS, help="only this one")
    options = parser.parse_args()
    folder = DATA / "hand_motion" / "leap"
    if not folder.is_dir():
        print(f"no {folder}; set RHOT_DATA to the folder of real recordings", file=sys.stderr)
        return 2
    recorded: dict[str, RecordedJoints] = {}
    wanted = [options.recording] if options.recording else list(RECORDINGS)
    for name, file in ((name, RECORDINGS[name]) for name in wanted):
        one = load_recording(folder / f"{file}.csv")
        if isinstance(one, RecordedJoints):
            recorded[name] = one
    print(
        f"{'dots':4s}  {'recording':10s}{'method':22s}{'right %':>11s}{'lost %':>11s}"
        f"{'exchanged':>11s}{'elsewhere':>11s}{'longest':>10s}{'ms':>9s}"
    )
    rows = []
    for dots in [options.dots] if options.dots else list(DOTS):
        for row in run(recorded, dots, options.clips, options.first_seed):
            rows.append(row)
            print(show(row), flush=True)
    if options.json:
        options.json.write_text(json.dumps(figures(rows), indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
