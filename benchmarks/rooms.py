"""How many markers are found in rooms that nobody arranged, and what is taken for one.

    python benchmarks/rooms.py [--tuning] [--rooms N] [--json FILE]

Rooms by number (testing/families/rooms.py; --tuning: those that constants may be chosen on): things
in the paints' colours, lamps from anywhere, noise, hands from 0.35 to 0.75 m away; three seconds,
both cameras, each with ranges fitted to clicks on the paint in that light
(testing/families/clicks.py). Rhot's tracker, live and as `rhot track` has it look at a recording's
beginning first, and the RHOT paper's look at the same pictures, which take nearly all of the time:
10 seconds a room.
    found    of markers of which 60 % or more are visible, the share that is told where its paint is
    astray   of markers that are told, the share that is on something else: more than 14 px off
    whole    of clips of a camera, the share in which 99 % are found
    median   of clips of a camera, the share found; and the lowest
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.messages import Marker
from services.cli.offline.frames.known_room import with_known_room
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.simulator.camera.frame_source import FrameSource
from testing.families.case import Half
from testing.families.clicks import clicked_colors
from testing.families.pictures import PaintMiddles, frame_of, visible_shares
from testing.families.rooms import FIRST, room
from testing.synthetic_points import START_NS

ROOMS = 24
# A marker so far from its paint's middle is on something else; a tip is 8 to 30 px wide.
ASTRAY_PX, VISIBLE = 14.0, 0.6


class Count(NamedTuple):
    """Markers of a clip of one camera."""

    visible: int = 0
    found: int = 0
    told: int = 0
    astray: int = 0


def with_method(config: RigConfig, method: str) -> RigConfig:
    """The rig with another kind of tracker."""
    tracker = msgspec.structs.replace(config.tracker, method=method)
    return msgspec.structs.replace(config, tracker=tracker)


def counts_in(number: int) -> dict[str, list[Count]]:
    """Of each method, the counts of both cameras in a room."""
    recipe = room(number)
    scene, hand = recipe.scene(), recipe.hand()
    landmarks = scene.hands[hand.hand].landmarks
    shares = visible_shares(recipe, scene)
    middles = PaintMiddles(scene, hand, tuple(landmarks))
    counts: dict[str, list[Count]] = {"rhot": [], "recording": [], "paper": []}
    for name, camera in scene.cameras.items():
        source = FrameSource(scene, name, recorded=True)
        colors = clicked_colors(recipe, name)
        frames: list[Frame] = []
        seen: list[dict[str, tuple[np.bool_, Array]]] = []
        for seq, visible in enumerate(shares[name] >= VISIBLE):
            taken = source.take(seq, START_NS)
            if taken.image is None:
                continue
            paint_px = camera.project(middles(np.array([taken.time_s]))[0])
            entries = zip(visible, paint_px, strict=True)
            frames.append(frame_of(taken))
            seen.append(dict(zip(landmarks.values(), entries, strict=True)))
        for method, own in counts.items():
            kind = "paper" if method == "paper" else "rhot"
            tracker = step_of_rig(with_method(scene.config, kind), name, colors)
            looked_at = with_known_room(frames, tracker) if method == "recording" else frames
            count = Count()
            for frame, wanted in zip(looked_at, seen, strict=True):
                count = counted(count, tracker.step(frame).markers, wanted)
            own.append(count)
    return counts


def counted(
    count: Count, markers: Sequence[Marker], wanted: Mapping[str, tuple[np.bool_, Array]]
) -> Count:
    """With a frame more; wanted: is each colour's marker visible, and where is its paint?"""
    told = {marker.color: marker for marker in markers}
    for color, (visible, (x_px, y_px)) in wanted.items():
        marker = told.get(color)
        right = marker is not None and (
            math.hypot(marker.x_px - x_px, marker.y_px - y_px) <= ASTRAY_PX
        )
        count = Count(
            count.visible + bool(visible),
            count.found + (bool(visible) and right),
            count.told + (marker is not None),
            count.astray + (marker is not None and not right),
        )
    return count


def figures_of(clips: Sequence[Count]) -> dict[str, float]:
    """The keys of the JSON file, of a method's clips."""
    visible, found, told, astray = (sum(column) for column in zip(*clips, strict=True))
    shares = [clip.found / max(clip.visible, 1) for clip in clips]
    return {
        "markers": visible,
        "found": found / visible,
        "astray": astray / max(told, 1),
        "whole": float(np.mean(np.array(shares) >= 0.99)),
        "median": float(np.median(shares)),
        "lowest": min(shares),
    }


def asked(description: str | None) -> argparse.Namespace:
    """What the command line asks for: first, number of the first room; rooms; json."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--tuning", action="store_true", help="rooms that constants are chosen on")
    parser.add_argument("--rooms", type=int, default=ROOMS, help=f"how many; {ROOMS}")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    arguments = parser.parse_args()
    half: Half = "tuning" if arguments.tuning else "held_out"
    arguments.first = FIRST[half]
    return arguments


def main() -> None:
    """Print a table; with --json, write it too."""
    arguments = asked(__doc__)
    clips: dict[str, list[Count]] = {}
    for number in range(arguments.first, arguments.first + arguments.rooms):
        for method, counts in counts_in(number).items():
            clips.setdefault(method, []).extend(counts)
            parts = (f"{c.found / max(c.visible, 1):7.1%} ({c.astray:3} astray)" for c in counts)
            print(f"room {number:5}  {method:9}", *parts, flush=True)
    figures = {method: figures_of(counts) for method, counts in clips.items()}
    print(f"{'':10}{'markers':>9}{'found':>9}{'astray':>9}{'whole':>8}{'median':>9}{'lowest':>9}")
    for method, row in figures.items():
        print(
            f"{method:10}{row['markers']:9.0f}{row['found']:9.2%}{row['astray']:9.2%}"
            f"{row['whole']:8.0%}{row['median']:9.2%}{row['lowest']:9.2%}"
        )
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
