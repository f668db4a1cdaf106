"""How far away a hand is found: `python benchmarks/distances.py [--frames N] [--seeds N]
[--json FILE]`.

Simulated hands at several distances, at rest and with fingers in random motion, sensor noise of 5
grey levels, both cameras. As in hard.py a marker counts where at least half of its paint shows:
    width_px      square root of the median marker's area
    found         share of the markers that are reported, by a tracker that follows the hand
    found_cold    the same of every picture shown to a new tracker: how likely a hand is found
    wrong         reported markers that are not on their paint, both ways together
Rendering takes nearly all of the time.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import statistics
import sys
from pathlib import Path
from typing import NamedTuple

import cv2
from hard import VISIBLE, frame_of, on_paint

from rhot.files.calibration import load_colors
from rhot.files.config import RigConfig, load_rig
from rhot.messages import MarkerFrame
from services.pi_tracker.rig_step import step_of_rig
from services.pi_tracker.step import TrackerStep
from services.simulator.camera.frame_source import FrameSource
from services.simulator.camera.visibility import sights
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import Scene, build_scene

ROOT = Path(__file__).parents[1]
DISTANCES_M = (0.5, 1.0, 1.15, 1.3, 1.5)
MOTIONS = {"at_rest": "still", "moving": "random"}


class Tally(NamedTuple):
    """Markers that show half of their paint, and what became of them."""

    visible: int = 0
    found: int = 0
    found_cold: int = 0
    wrong: int = 0

    def plus(self, other: Tally) -> Tally:
        """Both together."""
        return Tally(*(a + b for a, b in zip(self, other, strict=True)))


def scene_at(config: RigConfig, motion: str, distance_m: float, seed: int) -> Scene:
    """A scene of the catalogue at another distance."""
    spec = dataclasses.replace(SCENES[motion], distance_m=distance_m, noise=5.0)
    return build_scene(config, spec, motion, seed)


def watch(config: RigConfig, scene: Scene, frames: int) -> tuple[Tally, list[float]]:
    """Both cameras of a scene; the areas of all markers that were followed, px."""
    tally, areas = Tally(), []
    landmarks = {color: name for name, color in config.hand["right"].markers.items()}
    for camera in scene.cameras:
        source = FrameSource(scene, camera)
        following = tracker(config, source)
        for seq in range(frames):
            taken = source.take(seq)
            if taken.image is None:
                continue
            frame = frame_of(taken)
            told = following.step(frame)
            cold = tracker(config, source).step(frame)
            tally = tally.plus(counted(source, taken.time_s, landmarks, told, cold))
            areas += [marker.area_px for marker in told.markers]
    return tally, areas


def tracker(config: RigConfig, source: FrameSource) -> TrackerStep:
    """A new tracker of that camera."""
    name = source.camera.name
    return step_of_rig(config, name, load_colors(config.calibration_dir, name))


def counted(
    source: FrameSource,
    time_s: float,
    landmarks: dict[str, str],
    told: MarkerFrame,
    cold: MarkerFrame,
) -> Tally:
    """One picture against the renderer's own account of what each pixel shows."""
    seen = {landmark: sight for (_, landmark), sight in sights(source.renderer, time_s).items()}
    labels = source.renderer.labels(time_s)
    surfaces = {name: surface for (_, name), surface in source.renderer.cast.marks.items()}
    tally = Tally()
    reports = [{marker.color: marker for marker in one.markers} for one in (told, cold)]
    for color, landmark in landmarks.items():
        shows = labels == 1 + surfaces[landmark]
        given = [report.get(color) for report in reports]
        right = [marker is not None and on_paint(marker, shows) for marker in given]
        wrong = sum(
            marker is not None and not good for marker, good in zip(given, right, strict=True)
        )
        visible = seen[landmark].share >= VISIBLE
        tally = tally.plus(Tally(visible, visible and right[0], visible and right[1], wrong))
    return tally


def measure(config: RigConfig, motion: str, distance_m: float, frames: int, seeds: int) -> dict:
    """The figures of one motion at one distance."""
    total, areas = Tally(), []
    for seed in range(1, seeds + 1):
        tally, more = watch(config, scene_at(config, motion, distance_m, seed), frames)
        total, areas = total.plus(tally), areas + more
    shown = max(total.visible, 1)
    return {
        "width_px": round(statistics.median(areas) ** 0.5, 2) if areas else None,
        "visible": total.visible,
        "found": round(total.found / shown, 5),
        "found_cold": round(total.found_cold / shown, 5),
        "wrong": total.wrong,
    }


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=25, help="of each camera and seed")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    config = load_rig(ROOT / "config" / "sim.toml")
    found: dict[str, dict[str, dict]] = {}
    for distance_m in DISTANCES_M:
        found[str(distance_m)] = {}
        for name, motion in MOTIONS.items():
            figures = measure(config, motion, distance_m, options.frames, options.seeds)
            found[str(distance_m)][name] = figures
            print(f"{distance_m} m, {name}: {figures}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
