"""Recall, identity and re-acquisition of pi_tracker in the simulator's hard scene.

`python benchmarks/hard.py [--frames N] [--seeds N] [--json FILE]`

Fast motion, blur, things of the paints' own colours in the room, coloured light on the skin. Both
cameras, one after the other, each with the colour ranges of config/calibration. Rendering takes
nearly all of the time (0.1 s a frame; the whole run 20 minutes). Ground truth is what the renderer
shows in each pixel (services/simulator/camera/visibility.py):
    recall              of the frames in which at least half of a patch is visible, the share in
                        which its marker is reported on it; the worst marker's. Half is of what
                        would be seen if no other part of the hand were there.
    wrong_identity      share of all reported markers that are not on their paint: more than 3 px
                        from every pixel that shows it
    refound_next_frame  of the frames that show half of a patch whose marker was lost, i.e. not
                        reported on it in the frame before, the share in which it is
A patch that the picture's edge cuts counts by what lies inside the picture.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from rhot.files.calibration import load_colors
from rhot.files.config import RigConfig, load_rig
from rhot.messages import Marker
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.simulator.camera.frame_source import FrameSource, TakenFrame
from services.simulator.camera.visibility import PatchVisibility, patch_visibility
from services.simulator.scene.scene import load_scene

ROOT = Path(__file__).parents[1]
SCENE = "hard"
MIN_VISIBLE = 0.5
# Shading, noise and blur move a centroid by less than a pixel; fingers are 10 px apart.
ON_PAINT_PX = 3.0


@dataclass
class Tally:
    """Counts of frames for one colour."""

    visible: int = 0  # at least half of the patch
    found: int = 0  # of those, with its marker on it
    reported: int = 0
    wrong: int = 0  # of those, not on the paint
    lost: int = 0  # visible, and not reported on it in the frame before
    refound: int = 0  # of those, with its marker on it
    # Whether it was reported in the last frame; None before it ever was: what was never found
    # cannot be lost.
    known: bool | None = None

    def add(
        self, sight: PatchVisibility, marker: Marker | None, paint: npt.NDArray[np.bool_]
    ) -> None:
        """Take in one frame; paint (h, w) is where the paint is seen."""
        right = marker is not None and on_paint(marker, paint)
        visible = sight.share >= MIN_VISIBLE
        self.visible += visible
        self.found += visible and right
        self.reported += marker is not None
        self.wrong += marker is not None and not right
        if visible and self.known is False:
            self.lost += 1
            self.refound += right
        if right or self.known is not None:
            self.known = right

    @property
    def recall(self) -> float:
        """Share of the frames that show half of it in which it is found."""
        return share(self.found, self.visible)


def share(part: int, whole: int) -> float:
    """1 of nothing."""
    return part / whole if whole else 1.0


def on_paint(marker: Marker, paint: npt.NDArray[np.bool_]) -> bool:
    """Whether a marker is on its paint (h, w)."""
    reach = int(ON_PAINT_PX)
    x, y = round(marker.x_px), round(marker.y_px)
    return bool(paint[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1].any())


def run(config: RigConfig, camera: str, seed: int, count: int, tallies: dict[str, Tally]) -> None:
    """Track `count` frames of one camera."""
    source = FrameSource(load_scene(config, SCENE, seed), camera)
    step = step_of_rig(config, camera, load_colors(config.calibration_dir, camera))
    landmarks = {
        color: landmark
        for table in config.hand.values()
        for landmark, color in table.markers.items()
    }
    for tally in tallies.values():
        tally.known = None
    for seq in range(count):
        taken = source.take(seq)
        if taken.image is None:
            continue
        markers = {marker.color: marker for marker in step.step(frame_of(taken)).markers}
        seen = {
            landmark: sight
            for (_, landmark), sight in patch_visibility(source.renderer, taken.time_s).items()
        }
        labels = source.renderer.labels(taken.time_s)
        surfaces = {
            landmark: surface
            for (_, landmark), surface in source.renderer.shapes.paint_surfaces.items()
        }
        for color, landmark in landmarks.items():
            tallies[color].add(seen[landmark], markers.get(color), labels == 1 + surfaces[landmark])


def frame_of(taken: TakenFrame) -> Frame:
    """As the simulator's source would hand it to the tracker."""
    assert taken.image is not None, "lost frames are left out"
    stamp_ns, row_time_ns = taken.stamp_ns, taken.row_time_ns
    return Frame(taken.camera, taken.seq, stamp_ns, row_time_ns, taken.size_px, taken.image, "i420")


def summary(tallies: dict[str, Tally]) -> dict[str, float]:
    """The keys of the JSON file."""
    reported, wrong, lost, refound = (
        sum(getattr(tally, name) for tally in tallies.values())
        for name in ("reported", "wrong", "lost", "refound")
    )
    return {
        "recall": min(tally.recall for tally in tallies.values()),
        "wrong_identity": share(wrong, reported) if reported else 0.0,
        "refound_next_frame": share(refound, lost),
        "reported": reported,
        "wrong": wrong,
        "lost": lost,
        **{f"recall_{color}": tally.recall for color, tally in tallies.items()},
    }


def print_table(tallies: dict[str, Tally]) -> None:
    """A line for each colour."""
    print(
        f"{'marker':10s} {'half visible':>12s} {'recall':>8s} "
        f"{'reported':>9s} {'wrong':>6s} {'lost':>5s} {'refound':>8s}"
    )
    for color, t in tallies.items():
        print(
            f"{color:10s} {t.visible:12d} {t.recall:8.4f} "
            f"{t.reported:9d} {t.wrong:6d} {t.lost:5d} {t.refound:8d}"
        )


def main() -> None:
    """Render, track, count, print, write."""
    parser = argparse.ArgumentParser(
        description="Recall, identity and recovery of pi_tracker in the simulator's hard scene"
    )
    parser.add_argument(
        "--frames", type=int, default=10_000, help="of all cameras and seeds together"
    )
    parser.add_argument("--seeds", type=int, default=5, help="different rooms and motions")
    parser.add_argument(
        "--first-seed", type=int, default=1, help="1 to 5 and 11 to 13 were tuned on"
    )
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    config = load_rig(ROOT / "config" / "sim.toml")
    tallies = {color: Tally() for color in config.colors}
    each = max(1, options.frames // (options.seeds * len(config.camera)))
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        for camera in config.camera:
            run(config, camera.name, seed, each, tallies)
            print(f"seed {seed}, camera {camera.name}: {each} frames", file=sys.stderr)
    result = summary(tallies)
    print_table(tallies)
    for name in ("recall", "wrong_identity", "refound_next_frame"):
        print(f"{name:20s} {result[name]:.5f}")
    if options.json:
        options.json.write_text(
            json.dumps({name: round(value, 6) for name, value in result.items()}, indent=1) + "\n",
            encoding="utf-8",
        )


if __name__ == "__main__":
    main()
