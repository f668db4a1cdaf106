"""The tracker by its compiled forms and in Python: how fast, and how far centres are apart.

`python benchmarks/tracker_compiled.py [--frames N] [--json FILE]`

Both track the same simulated pictures (six colours, 640 x 480) in one process, in turns of thirty,
each with a tracker of its own. Times are the processor's, medians of five rounds' medians; ratios
are Python's over the compiled form's, the median of the rounds with the least and the most of them:
    refine  the centres of a picture's markers, from blobs on
    step    the whole step: picture in memory -> message encoded; the search, too, by each form
`markers` is how many were compared, `apart_px` how far the two centres of a marker are apart at
most, `apart_95_px` in 95 % of the markers: messages are rounded to a thousandth of a pixel, these
are not. Where the tracker has no compiled form, it says so and ends.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from tracker import CAMERA, ROOT, SCENE, simulated
from tracker_speed import ROUNDS, TURN, keep_memory

from rhot.files.calibration import load_colors
from rhot.files.config import load_rig
from rhot.files.rig_tables import Tracker
from services.pi_tracker.compiled import library
from services.pi_tracker.detect import marker_finder
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import Picture
from services.pi_tracker.measure import centroid, centroid_compiled
from services.pi_tracker.measure.centroid import Centroid
from services.pi_tracker.measure.grown_blob import Growth
from services.pi_tracker.step import TrackerStep

Measure = Callable[[Picture, Sequence[Blob], Noise, Growth | None], list[Centroid]]


class Timed:
    """One form of the centroids, with the time that each call took, ns."""

    def __init__(self, measure: Measure) -> None:
        self._measure = measure
        self.last_ns = 0

    def __call__(
        self, picture: Picture, blobs: Sequence[Blob], noise: Noise, growth: Growth | None
    ) -> list[Centroid]:
        """Measure, and note how long it took."""
        started = time.thread_time_ns()
        found = self._measure(picture, blobs, noise, growth)
        self.last_ns = time.thread_time_ns() - started
        return found


def search_in_python(step: TrackerStep) -> None:
    """Leave the compiled search out of a tracker."""
    finder = step._finder
    assert isinstance(finder, marker_finder.MarkerFinder)
    finder._detector._compiled = finder._unfiltered_detector._compiled = None


def in_turns(frames: list[Frame], forms: dict[str, Measure]) -> dict[str, list[int]]:
    """Durations of the centres and of the step of each form, ns, frame by frame."""
    config = load_rig(ROOT / "config" / "sim.toml")
    colors = load_colors(config.calibration_dir, CAMERA)
    steps = {
        name: TrackerStep(CAMERA, colors, Tracker(), (640, 480), config.colors) for name in forms
    }
    if "python" in steps:
        search_in_python(steps["python"])
    encoder, times = msgspec.json.Encoder(), defaultdict(list)
    for begin in range(0, len(frames), TURN):
        for name, measure in forms.items():
            marker_finder.centroids = timed = Timed(measure)
            for frame in frames[begin : begin + TURN]:
                started = time.thread_time_ns()
                encoder.encode(steps[name].step(frame))
                times[f"{name}_step"].append(time.thread_time_ns() - started)
                times[f"{name}_refine"].append(timed.last_ns)
    return times


def speed(times: dict[str, list[int]]) -> dict[str, float]:
    """Medians of the rounds, ms, and ratios."""
    # The first frames of all warm the machine up.
    rounds = {
        name: np.array([np.median(part) for part in np.array_split(values[TURN // 2 :], ROUNDS)])
        for name, values in times.items()
    }
    result = {f"{name}_ms": float(np.median(values)) * 1e-6 for name, values in rounds.items()}
    for what in ("refine", "step"):
        ratios = rounds[f"python_{what}"] / rounds[f"compiled_{what}"]
        result |= {
            f"{what}_ratio": float(np.median(ratios)),
            f"{what}_ratio_low": float(ratios.min()),
            f"{what}_ratio_high": float(ratios.max()),
        }
    return result


def agreement(frames: list[Frame], forms: dict[str, Measure]) -> dict[str, float]:
    """How far apart the centres are that both forms find of the same blobs, px."""
    apart: list[float] = []

    def both(
        picture: Picture, blobs: Sequence[Blob], noise: Noise, growth: Growth | None
    ) -> list[Centroid]:
        found = [measure(picture, blobs, noise, growth) for measure in forms.values()]
        apart.extend(
            max(abs(one.x_px - other.x_px), abs(one.y_px - other.y_px))
            for one, other in zip(*found, strict=True)
        )
        return found[0]

    in_turns(frames, {"both": both})
    return {
        "markers": len(apart),
        "apart_px": max(apart),
        "apart_95_px": float(np.percentile(apart, 95)),
    }


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description="The compiled centroids beside those in Python")
    parser.add_argument("--frames", type=int, default=150)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    compiled = centroid_compiled.centroids
    if compiled is None:
        sys.exit(f"markers are measured {library.state}")
    forms: dict[str, Measure] = {"python": centroid.centroids, "compiled": compiled}
    cv2.setNumThreads(1)
    keep_memory()
    frames = simulated(load_rig(ROOT / "config" / "sim.toml"), SCENE, max(options.frames, 3 * TURN))
    result: dict[str, Any] = speed(in_turns(frames, forms)) | agreement(frames, forms)
    for name, value in result.items():
        print(f"{name:22s} {value:12.7f}")
    if options.json:
        figures = {name: float(f"{value:.4g}") for name, value in result.items()}
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
