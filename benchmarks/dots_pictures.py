"""Dots of one colour on rendered hands, told apart: which dot is which, through the real tracker.

    RHOT_DATA=FOLDER python benchmarks/dots_pictures.py [--tuning] [--dots 8] [--clips 3]
                                     [--motion PART] [--hindsight [8 15]] [--json FILE]

Rendered hands (testing/families/dotted_hands.py): people, sides, skins; dots lie on the skin and
are hidden as fingers close. One camera, 30 pictures a second, 640x480. Seeds are clicks of the
first picture, 1.5 px off. A dot counts if a third of its disc shows or more. Of each motion:
    right      share of these dots that are told, within 10 px or 1.3 of their radii
    lost       told as nowhere
    exchanged  told where another one is
    longest    pictures for which names were exchanged at worst, one after the other
for plain assignment to the nearest patches, rhot live, and, with as many dots as --hindsight says,
rhot with hindsight, which takes long. Only the half that is held out is evidence; --tuning is what
constants were chosen on.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from dots import Told, judge, moved_to_nearest

from rhot.geometry.transforms import Array
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.dots.dot import SeenPatches
from services.pi_tracker.dots.finder import DotFinder
from testing.families.dotted_hands import (
    HALVES,
    DottedHand,
    DottedPicture,
    clips,
    colors_of,
    pictures_of,
)

CLICK_PX = 1.5
COUNTS = ("right", "lost", "exchanged", "elsewhere")


def followed(
    clip: DottedHand, *, hindsight: bool
) -> tuple[list[DottedPicture], dict[str, list[Told]]]:
    """The pictures of a clip, and where each method tells its dots in each."""
    config, names = clip.config(), clip.landmarks
    table = compile_colors(colors_of(clip), config.colors)
    random = np.random.default_rng(clip.seed)
    pictures: list[DottedPicture] = []
    live: list[Told] = []
    finder: DotFinder | None = None
    for picture in pictures_of(clip):
        if finder is None:
            clicks = picture.places + random.normal(0.0, CLICK_PX, picture.places.shape)
            seeds = {n: (float(x), float(y)) for n, (x, y) in zip(names, clicks, strict=True)}
            finder = DotFinder(
                table,
                clip.color,
                config.tracker,
                names,
                picture.frame.size_px,
                seeds,
                remembers=True,
            )
        dots = finder.find(picture.frame)
        live.append({n: (d.x_px, d.y_px) for n, d in dots.items() if d.state != "carried"})
        pictures.append(picture)
    assert finder is not None
    told = {"optimal assignment": _nearest(names, clicks, finder.seen), "rhot": live}
    if hindsight:
        told["rhot, with hindsight"] = [
            {name: (dot.x_px, dot.y_px) for name, dot in dots.items()}
            for dots in finder.looked_back()
        ]
    return pictures, told


def _nearest(names: Sequence[str], clicks: Array, seen: Sequence[SeenPatches]) -> list[Told]:
    """What the assignment of least distance to where dots were tells."""
    last = clicks.copy()
    told: list[Told] = []
    for picture in seen:
        own = moved_to_nearest(last, picture.patches, optimal=True)
        told.append(
            {n: (float(last[k, 0]), float(last[k, 1])) for k, n in enumerate(names) if own[k] >= 0}
        )
    return told


def measured(
    half: str, dots: int, count: int, part: str, *, hindsight: bool
) -> dict[str, dict[str, Any]]:
    """Counts by motion and method, and of all motions whose name has this part."""
    found: dict[str, dict[str, Any]] = {}
    for motion, clip in clips(half, dots, count, part):
        began_s = time.perf_counter()
        pictures, told = followed(clip, hindsight=hindsight)
        for method, places in told.items():
            own = judge(pictures, clip.landmarks, places)
            for name in (motion, "all"):
                total = found.setdefault(name, {}).setdefault(method, {"clips": 0, "least": 100.0})
                longest = max(total.get("longest", 0), own["longest"])
                for key, value in own.items():
                    total[key] = total.get(key, 0) + value
                total["longest"] = longest
                total["clips"] += 1
                total["least"] = min(total["least"], 100.0 * own["right"] / own["dots"])
        print(f"  {motion} {clip.seed}: {time.perf_counter() - began_s:.0f} s", file=sys.stderr)
    return found


def show(found: dict[str, dict[str, Any]], dots: int) -> None:
    """Lines of the table."""
    for motion, methods in found.items():
        for method, total in methods.items():
            shares = "".join(f"{100.0 * total[key] / total['dots']:11.2f}" for key in COUNTS)
            least, longest = total["least"], total["longest"]
            print(f"{dots:4d}  {motion:24s}{method:22s}{shares}{least:9.1f}{longest:9d}")


def figures(found: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Shares in percent, by motion and method."""
    return {
        motion: {
            method: {
                f"{key}_percent": round(100.0 * total[key] / total["dots"], 2) for key in COUNTS
            }
            | {
                "clips": total["clips"],
                "least_percent": round(total["least"], 1),
                "longest_exchange_frames": total["longest"],
            }
            for method, total in methods.items()
        }
        for motion, methods in found.items()
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the half that constants rest on")
    parser.add_argument("--motion", default="", help="only those whose name has this in it")
    parser.add_argument("--dots", type=int, choices=(8, 15), help="only so many")
    parser.add_argument("--clips", type=int, default=3, help="of each motion")
    parser.add_argument(
        "--hindsight", type=int, nargs="*", default=[8, 15], help="dots looked back at, too"
    )
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    data = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not (data / "hand_motion" / "leap").is_dir():
        print(f"no {data}; set RHOT_DATA to the folder of real recordings", file=sys.stderr)
        return 2
    heads = "".join(f"{key + ' %':>11s}" for key in COUNTS)
    print(f"{'dots':4s}  {'motion':24s}{'method':22s}{heads}{'least %':>9s}{'longest':>9s}")
    result: dict[str, Any] = {}
    for dots in [options.dots] if options.dots else [8, 15]:
        half = HALVES[0] if options.tuning else HALVES[1]
        found = measured(
            half, dots, options.clips, options.motion, hindsight=dots in options.hindsight
        )
        show(found, dots)
        result[str(dots)] = figures(found)
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
