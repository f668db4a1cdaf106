"""pi_tracker versus the RHOT paper's pipeline: how fast and how exact, in one process.

`python benchmarks/tracker.py [--frames N] [--json FILE]`

The paper's pipeline is re-created (services/pi_tracker/detect/paper_finder.py): per colour HSV,
Gaussian, threshold, erosion, dilation, contours, largest, centroid. Both see the same simulated
pictures, six colours, 640 x 480, stage by stage in turns of thirty frames (tracker_speed.py). The
pictures make five rounds. A round's times are medians and its ratios theirs. Reported are the
median of the rounds, and for ratios the least and the most of them (`_low`, `_high`). Times are the
processor's, so that other programs do not lengthen the longer one; only `step` is wall time:
    search   the whole image to the blobs of all colours
    roi      the same around the last places: the paper with its 40 px margin, ours with what the
             motion asks for, up to 40 px
    step     ours in all: frame in memory -> identity, sub-pixel position, sigma -> message encoded
search_ratio and roi_ratio are the paper's over ours. The paper ends with a contour's centroid; ours
goes on: `refine` is that part, and roi_all_ratio counts it. In the JSON file `seed` is the paper's
pipeline, as it was called when older results were written: so they can be compared.

Precision is that of a 9 px tip at 5 grey levels of noise: disparity between independently noisy
views, and error against the truth; and the scatter of a simulated hand held still.

With $RHOT_DATA (default ../shared/data) both track a real video: six colours sought in all of it
(one is there), and that one alone, where our cost per picture weighs more. With mediapipe 0.10.21
installed its hand detector is timed beside them. What was left out is in the output.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import time
from collections import defaultdict
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from tracker_speed import TURN, Times, keep_memory, ratios, speed, summarised, timed

from rhot.files.calibration import ColorRange, Colors, load_colors
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import Tracker
from rhot.messages import Marker
from services.pi_tracker.detect.paper_finder import PaperFinder
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.video import VideoReader
from services.pi_tracker.step import TrackerStep
from services.simulator.camera.frame_source import FrameSource
from services.simulator.scene.scene import load_scene
from testing import synthetic_images

ROOT = Path(__file__).parents[1]
DATA = Path(os.environ.get("RHOT_DATA", ROOT.parent / "shared" / "data"))
SCENE, CAMERA = "piano", "left"
VIEWS, NOISE = 240, 5.0
# Finger tips among the 21 landmarks of MediaPipe.
TIPS = {"thumb_tip": 4, "index_tip": 8, "middle_tip": 12, "ring_tip": 16, "little_tip": 20}
BALL = Colors(colors={"green": ColorRange(hsv_low=(35, 60, 40), hsv_high=(85, 255, 255))})
# The tracker's methods, and their names in the JSON file.
METHODS = {"lut": Tracker(method="lut"), "seed": Tracker(method="paper")}


def simulated(config: RigConfig, scene: str, count: int) -> list[Frame]:
    """Pictures of one simulated camera."""
    source = FrameSource(load_scene(config, name=scene, seed=1), CAMERA)
    taken = (source.take(seq) for seq in range(count))
    return [
        Frame(CAMERA, t.seq, t.stamp_ns, t.row_time_ns, t.size_px, t.image, "i420")
        for t in taken
        if t.image is not None
    ]


def precision() -> dict[str, float]:
    """Both pipelines on pairs of noisy views of single tips, in changing light and background."""
    rng = np.random.default_rng(1)
    errors: dict[str, list[list[float]]] = {"ours": [], "paper": []}
    normalised: list[float] = []
    for n in range(VIEWS):
        name = list(synthetic_images.PAINTS)[n % len(synthetic_images.PAINTS)]
        pair: dict[str, list[float]] = {"ours": [], "paper": []}
        for side, (clean, truth) in enumerate(view_pair(name, rng)):
            found = both_markers(name, synthetic_images.noisy(clean, NOISE, 2 * n + side))
            for kind, marker in found.items():
                if marker is not None:
                    pair[kind] += [marker.x_px - truth[name][0], marker.y_px - truth[name][1]]
            ours = found["ours"]
            if ours is not None:
                normalised += [
                    (ours.x_px - truth[name][0]) / ours.sigma_px,
                    (ours.y_px - truth[name][1]) / ours.sigma_px,
                ]
        for kind, values in pair.items():
            if len(values) == 4:
                errors[kind].append(values)
    # Columns x, y of the first view, x, y of the second.
    ours_px, paper_px = np.array(errors["ours"]), np.array(errors["paper"])  # (n, 4)
    return {
        "disparity_rms_px": rms(ours_px[:, 2] - ours_px[:, 0]),
        "bias_px": rms(ours_px),
        "normalised_error": rms(np.array(normalised)),
        "missed": 1.0 - len(ours_px) / VIEWS,
        "seed_disparity_rms_px": rms(paper_px[:, 2] - paper_px[:, 0]),
        "seed_bias_px": rms(paper_px),
    }


def view_pair(name: str, rng: np.random.Generator) -> list[tuple[Any, dict[str, Any]]]:
    """Two pictures without noise of one tip, sub-pixel apart, and the truth of each."""
    x, y, apart = (*(32 + rng.uniform(-1, 1, 2)), rng.uniform(-1, 1))
    shape = {
        "length_px": 9 * rng.uniform(0.9, 1.3),
        "turn_rad": rng.uniform(0, 2 * np.pi),
        "light_rad": rng.uniform(-1, 1),
    }
    wall = tuple(rng.uniform(60, 200) + rng.uniform(-10, 10, 3))
    tips = [synthetic_images.Tip(name, x + side * apart, y, 9.0, **shape) for side in range(2)]
    return [synthetic_images.clean([tip], (64, 64), wall=wall) for tip in tips]


def both_markers(name: str, bgr: Any) -> dict[str, Marker | None]:
    """The marker of one colour by both pipelines, each a new one."""
    colors, settings = synthetic_images.ranges(), Tracker()
    step = TrackerStep("left", colors, settings, (64, 64), [name])
    paper = PaperFinder(colors, settings, [name])
    ours = step.step(synthetic_images.frame_of(bgr)).markers
    theirs = paper.find(synthetic_images.frame_of(bgr, layout="bgr"))
    return {"ours": ours[0] if ours else None, "paper": theirs[0] if theirs else None}


def rms(values: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def real_video(path: Path, colors: Colors) -> dict[str, float]:
    """Both pipelines over a real recording of a ball.

    Jitter is the median second difference of the centre's x, px.
    """
    x_px: dict[str, dict[int, float]] = {name: {} for name in METHODS}
    steps = {
        name: TrackerStep("cam", BALL, settings, (640, 480), ["green"])
        for name, settings in METHODS.items()
    }
    reader, frames = VideoReader("cam", path, 30.0), []
    reader.open()
    while (frame := reader.read()) is not None:
        frames.append(replace(frame, image=synthetic_images.i420(frame.image), layout="i420"))
        for name, step in steps.items():
            markers = step.step(frame).markers
            if markers:
                x_px[name][frame.seq] = markers[0].x_px
    reader.close()
    result = video_speed(frames, colors)
    for name, seen in x_px.items():
        second = [
            seen[n - 1] - 2 * seen[n] + seen[n + 1] for n in seen if n - 1 in seen and n + 1 in seen
        ]
        result |= {
            f"video_{name}_found": len(seen),
            f"video_{name}_jitter_px": float(np.median(np.abs(second))),
        }
    return result


def video_speed(frames: list[Frame], colors: Colors) -> dict[str, float]:
    """Speed on real pictures, with the ball's colour alone and with five others.

    The paper's time grows with the colours sought. The others are not in the picture, so only
    searching the whole of it can be compared.
    """
    others = {name: span for name, span in colors.colors.items() if name != "green"}
    six = Colors(colors=BALL.colors | others)
    every = frames[:: max(1, len(frames) // 200)]
    result = summarised(ratios(speed(frames[:200], BALL, ["green"]), "video_one_colour_"))
    times = speed(every, six, sorted(six.colors))
    times |= {f"{name}_ms": values for name, values in times.items()} | ratios(times)
    kept = ("search_ratio", "search_ms", "seed_search_ms")
    return result | summarised({f"video_{name}": times[name] for name in kept})


def at_rest(config: RigConfig, colors: Colors, count: int) -> tuple[dict[str, float], list[str]]:
    """A hand held still: scatter of its tips' x from frame to frame, px.

    Of both pipelines, and of MediaPipe Hands if it is installed; and what is left out.
    """
    frames = simulated(config, "still", count)
    tips = {config.hand["right"].markers[tip]: number for tip, number in TIPS.items()}
    result: dict[str, float] = {}
    for name, settings in METHODS.items():
        step = TrackerStep(CAMERA, colors, settings, (640, 480), list(tips))
        found = [
            {marker.color: marker.x_px for marker in step.step(frame).markers} for frame in frames
        ]
        key = "still_jitter_px" if name == "lut" else f"{name}_still_jitter_px"
        result[key] = jitter([[one.get(color, np.nan) for color in tips] for one in found])
    if not importlib.util.find_spec("mediapipe"):
        return result, ["mediapipe: not installed (pip install mediapipe==0.10.21)"]
    return result | mediapipe_at_rest(frames, list(tips.values())), []


def mediapipe_at_rest(frames: list[Frame], landmarks: list[int]) -> dict[str, float]:
    """MediaPipe's time per picture, scatter, and share of missing landmarks."""
    import mediapipe

    times: Times = defaultdict(list)
    x_px: list[list[float]] = []
    with mediapipe.solutions.hands.Hands(max_num_hands=1) as hands:
        for frame in frames:
            rgb = cv2.cvtColor(frame.image, cv2.COLOR_YUV2RGB_I420)
            found = timed(times, "ms", partial(hands.process, rgb), time.perf_counter_ns)
            seen = found.multi_hand_landmarks
            x_px.append(
                [seen[0].landmark[number].x * 640 if seen else np.nan for number in landmarks]
            )
    return {
        "mediapipe_ms": float(np.median(times["ms"])) * 1e-6,
        "mediapipe_still_jitter_px": jitter(x_px),
        "mediapipe_missed": float(np.isnan(x_px).mean()),
    }


def jitter(x_px: list[list[float]]) -> float:
    """Scatter of resting points (frames, points) about their slow motion.

    From second differences, which have 1 + 4 + 1 times the variance. The median's 1 / .6745 makes
    it a standard deviation that a frame's mistake does not rule.
    """
    second = np.abs(np.diff(np.array(x_px), 2, axis=0))
    return float(np.sqrt(np.mean(np.nanmedian(second, axis=0) ** 2) / 6.0)) / 0.6745


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(
        description="Speed and precision of pi_tracker versus the RHOT paper's pipeline"
    )
    parser.add_argument("--frames", type=int, default=150)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    keep_memory()
    config = load_rig(ROOT / "config" / "sim.toml")
    colors = load_colors(config.calibration_dir, CAMERA)
    times = speed(simulated(config, SCENE, max(options.frames, 3 * TURN)), colors, config.colors)
    stages = ratios(times) | {f"{name}_ms": values for name, values in times.items()}
    result: dict[str, Any] = summarised(stages) | precision()
    video = DATA / "color_video" / "ball2.mp4"
    skipped = [] if video.is_file() else [f"real video: no {video} (set RHOT_DATA)"]
    if video.is_file():
        result |= real_video(video, colors)
    resting, without = at_rest(config, colors, options.frames)
    report(result | resting, skipped + without, options.json)


def report(result: dict[str, Any], skipped: list[str], path: Path | None) -> None:
    """A table, and the same as JSON."""
    for name, value in result.items():
        print(f"{name:35s} {value:10.3f}")
    for reason in skipped:
        print(f"left out: {reason}")
    if path:
        figures = {name: round(value, 4) for name, value in result.items()} | {"left_out": skipped}
        path.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
