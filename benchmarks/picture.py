"""What a Pi's sharpening and denoising cost, and that both ranges of YUV420 are as good as each
other: `python benchmarks/picture.py [--seconds N] [--seeds N] [--json FILE]`.

The same pictures as they come from the sensor, and as a Pi's image processor would deliver them by
default (services.simulator.camera.processing.py, a model that was not compared with a Pi):
    plain        what rhot asks of a Pi's camera
    sharpened    libcamera's Sharpness 1, its default
    denoised     0.75, as the tuning files have it
    both         what picamera2's video configuration delivers unless it is told otherwise
    full_range   plain, with luma in 0..255
Of a single 9 px tip at 5 grey levels of noise, as in tracker.py: the disparity's RMS between two
independently noisy views, the error against the truth, that over sigma_px, and the share that is
missed. Of a moving hand half a metre away, through fusion: how many
markers are reported beside the plain pictures', and the depth error of its points. Rendering takes
nearly all of the time.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from accuracy_pictures import Pictures
from tracker import rms, view_pair

from rhot.files.calibration import load_colors
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import Fusion, Tracker
from rhot.files.simulator_table import Simulator
from rhot.messages import MarkerFrame
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.pi_tracker.step import TrackerStep
from services.simulator.camera.frame_source import FrameSource, TakenFrame
from services.simulator.camera.processing import processed
from services.simulator.scene.scene import Scene
from testing import synthetic_images
from testing.synthetic_points import START_NS

ROOT = Path(__file__).parents[1]
VARIANTS = {
    "plain": Simulator(),
    "sharpened": Simulator(sharpen=1.0),
    "denoised": Simulator(denoise=0.75),
    "both": Simulator(sharpen=1.0, denoise=0.75),
    "full_range": Simulator(full_range=True),
}
VIEWS, NOISE = 240, 5.0
MOTION, DISTANCE_M = "random", 0.5
# What a camera's clock may be off by its own account.
CLOCK_SIGMA_NS = 500_000


def tips(settings: Simulator) -> dict[str, float]:
    """Pairs of views of single tips, in changing light and before changing walls."""
    rng = np.random.default_rng(1)
    errors_px, normalised = [], []
    for n in range(VIEWS):
        name = list(synthetic_images.PAINTS)[n % len(synthetic_images.PAINTS)]
        pair: list[float] = []
        for side, (clean, truth) in enumerate(view_pair(name, rng)):
            bgr = synthetic_images.noisy(clean, NOISE, 2 * n + side)
            frame = synthetic_images.frame_of(bgr, full_range=settings.full_range)
            frame = replace(frame, image=processed(frame.image, NOISE, settings))
            step = TrackerStep("left", synthetic_images.ranges(), Tracker(), (64, 64), [name])
            for marker in step.step(frame).markers:
                error = [marker.x_px - truth[name][0], marker.y_px - truth[name][1]]
                pair += error
                normalised += [value / marker.sigma_px for value in error]
        if len(pair) == 4:
            errors_px.append(pair)
    found = np.array(errors_px)  # (n, 4): x, y of the first view, x, y of the second
    return {
        "disparity_rms_px": rms(found[:, 2] - found[:, 0]),
        "error_px": rms(found),
        "normalised_error": rms(np.array(normalised)),
        "missed": 1.0 - len(found) / VIEWS,
    }


class Film:
    """The pictures of scenes, rendered once for every way to process them."""

    def __init__(self) -> None:
        self._taken: dict[tuple[int, str, bool], list[TakenFrame]] = {}
        self.settings = Simulator()
        self.markers = 0

    def detect(self, config: RigConfig, scene: Scene, seconds: float) -> list[MarkerFrame]:
        """What the tracker finds in all cameras' pictures, processed by `settings`."""
        found: list[tuple[float, MarkerFrame]] = []
        for name in scene.cameras:
            colors = load_colors(config.calibration_dir, name)
            tracker = step_of_rig(config, name, colors)
            found += [
                (taken.time_s, tracker.step(self._frame(taken), 0, CLOCK_SIGMA_NS))
                for taken in self._pictures(scene, name, seconds)
            ]
        self.markers += sum(len(frame.markers) for _, frame in found)
        return [frame for _, frame in sorted(found, key=lambda entry: entry[0])]

    def _frame(self, taken: TakenFrame) -> Frame:
        assert taken.image is not None, "lost frames are left out"
        image = processed(taken.image, NOISE, self.settings)
        stamp_ns, row_time_ns = taken.stamp_ns, taken.row_time_ns
        return Frame(
            taken.camera,
            taken.seq,
            stamp_ns,
            row_time_ns,
            taken.size_px,
            image,
            "i420",
            taken.full_range,
        )

    def _pictures(self, scene: Scene, camera: str, seconds: float) -> list[TakenFrame]:
        key = (scene.seed, camera, self.settings.full_range)
        if key not in self._taken:
            source = FrameSource(scene, camera, recorded=True)
            source.renderer.full_range = self.settings.full_range
            count = int(seconds * scene.config.camera_named(camera).fps)
            taken = (source.take(seq, START_NS) for seq in range(count))
            wide = self.settings.full_range
            self._taken[key] = [replace(t, full_range=wide) for t in taken if t.image is not None]
        return self._taken[key]


def hands(config: RigConfig, film: Film, seconds: float, seeds: int) -> dict[str, float]:
    """A moving hand, through fusion."""
    film.markers = 0
    still = (0.0, 0.0, 0.0)
    numbers = tuple(range(1, seeds + 1))
    pictures = Pictures(config, MOTION, DISTANCE_M, still, seconds, numbers, film.detect)
    score = pictures.score(Fusion())
    figures = score.figures()
    return {
        "markers": film.markers,
        "rms_mm": figures["rms"],
        "depth_mm": figures["z"],
        "depth_precision_mm": score.precision_z_mm(),
        "depth_bias_mm": score.bias_z_mm(),
    }


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=3.0, help="of the moving hand")
    parser.add_argument("--seeds", type=int, default=2, help="hands and walls")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    config = load_rig(ROOT / "config" / "sim.toml")
    film, result = Film(), dict[str, dict[str, Any]]()
    for name, settings in VARIANTS.items():
        film.settings = settings
        found = tips(settings) | hands(config, film, options.seconds, options.seeds)
        found["markers_share"] = found["markers"] / result.get("plain", found)["markers"]
        result[name] = {key: round(value, 4) for key, value in found.items()}
        print(f"{name:12s} {result[name]}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
