"""The eye beside the seed's: how fast and how exact, in one process: `python benchmarks/tracker.py
[--frames N] [--json FILE]`.

The seed's pipeline is re-created (services/pi_tracker/detect/paper_finder.py): per colour HSV,
Gaussian, threshold, erosion, dilation, contours, largest, centroid. Both see the same simulated
pictures, six colours, 640 x 480, stage by stage in turns of thirty frames so that the machine's
moods hit both; ours as the camera's YUV420, the seed's as BGR (whose conversion is not counted).
The pictures make five rounds. A round's times are medians and its ratios theirs; told are the
median of the rounds, and for ratios the least and the most of them (`_low`, `_high`). Times are the
processor's, lest other programs lengthen the longer one, but for `step`, which is the clock's:
    search   the whole image to the blobs of all colours
    roi      the same around the last places: the seed with its 40 px margin, ours with what the
             motion asks for, up to 40 px
    step     ours in all: frame in hand -> identity, sub-pixel position, sigma -> message encoded
search_ratio and roi_ratio are the seed's over ours. The seed ends with a contour's centroid; ours
goes on: `refine` is that part, and roi_all_ratio counts it.

Precision is that of a 9 px tip at 5 grey levels of noise: disparity between independently noisy
views, and error against the truth; and the scatter of a simulated hand held still.

With $RHOT_DATA (default ../shared/data) both track a real video: six colours sought in all of it
(one is there), and that one alone, where our cost per picture weighs more. With mediapipe 0.10.21
installed its hand detector is timed beside them. What is left out is said.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import importlib.util
import json
import os
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import numpy.typing as npt

from rhot.files.calibration import ColorRange, Colors, load_colors
from rhot.files.config import RigConfig, Tracker, load_rig
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import Blob, Searcher
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.paper_finder import PaperFinder
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import Rect, picture
from services.pi_tracker.sources.video import VideoReader
from services.pi_tracker.step import TrackerStep
from services.simulator.camera.frame_source import FrameSource
from services.simulator.scene.scene import load_scene
from testing import synthetic_images

ROOT = Path(__file__).parents[1]
DATA = Path(os.environ.get("RHOT_DATA", ROOT.parent / "shared" / "data"))
# After a change of turns the first pictures take up to three times as long, ours more than the
# seed's: the caches hold the other's data. A tracker that runs has no such turns; in 30 pictures
# they weigh little.
SCENE, CAMERA, TURN, ROUNDS = "piano", "left", 30, 5
VIEWS, NOISE = 240, 5.0
# Finger tips among the 21 landmarks of MediaPipe.
TIPS = {"thumb_tip": 4, "index_tip": 8, "middle_tip": 12, "ring_tip": 16, "little_tip": 20}
# glibc's malloc.h
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
BALL = Colors(colors={"green": ColorRange(hsv_low=(35, 60, 40), hsv_high=(85, 255, 255))})

Times = dict[str, list[int]]
# One value per round.
Rounds = dict[str, npt.NDArray[np.float64]]


def timed(
    times: Times, name: str, work: Callable[[], Any], clock: Callable[[], int] = time.thread_time_ns
) -> Any:
    """Run once and note how long it took, ns."""
    started = clock()
    result = work()
    times[name].append(clock() - started)
    return result


def simulated(config: RigConfig, scene: str, count: int) -> list[Frame]:
    """Pictures of one simulated camera."""
    source = FrameSource(load_scene(config, name=scene, seed=1), CAMERA)
    taken = (source.take(seq) for seq in range(count))
    return [
        Frame(CAMERA, t.seq, t.stamp_ns, t.row_time_ns, t.size_px, t.image, "i420")
        for t in taken
        if t.image is not None
    ]


def as_bgr(frame: Frame) -> Frame:
    """The same picture as the seed's camera delivers it."""
    return replace(frame, image=cv2.cvtColor(frame.image, cv2.COLOR_YUV2BGR_I420), layout="bgr")


def in_hand(frame: Frame) -> Frame:
    """The frame just written to memory, as a camera's driver leaves it."""
    return replace(frame, image=frame.image.copy())


def speed(frames: list[Frame], colors: Colors, wanted: Sequence[str]) -> Rounds:
    """Both pipelines over frames that show all colours, stage by stage in turns.

    Medians of each round in ms.
    """
    times: Times = defaultdict(list)
    searcher = Searcher(compile_colors(colors, wanted), Tracker())
    step = TrackerStep(CAMERA, colors, Tracker(), (640, 480), wanted, time.thread_time_ns)
    encoder, tracking = msgspec.json.Encoder(), PaperFinder(colors, Tracker(), wanted)
    for start in range(0, len(frames), TURN):
        ours = frames[start : start + TURN]
        theirs = [as_bgr(frame) for frame in ours]
        found = [
            timed(times, "search", partial(everywhere, searcher, frame))
            for frame in map(in_hand, ours)
        ]
        hulls = [
            search_region.hull(blob.rect for blob in blobs) if blobs else None for blobs in found
        ]
        for frame, before, last in zip(map(in_hand, ours[2:]), hulls, hulls[1:], strict=False):
            if last:
                timed(times, "roi", partial(nearby, searcher, frame, before, last))
        for frame in map(in_hand, ours):
            timed(
                times,
                "step",
                lambda frame=frame: encoder.encode(step.step(frame)),
                time.perf_counter_ns,
            )
            times["refine"].append(round(step.times_ms["centroid"] * 1e6))
        for frame in map(in_hand, theirs):
            timed(times, "seed_search", partial(PaperFinder(colors, Tracker(), wanted).find, frame))
        for frame in map(in_hand, theirs):
            timed(times, "seed_roi", partial(tracking.find, frame))
    # The first frames of all warm the machine up.
    parts = {name: np.array_split(values[TURN // 2 :], ROUNDS) for name, values in times.items()}
    return {
        name: np.array([np.median(part) for part in rounds]) * 1e-6
        for name, rounds in parts.items()
    }


def told(rounds: Rounds) -> dict[str, float]:
    """The median of the rounds, and how far ratios range."""
    result: dict[str, float] = {}
    for name, values in rounds.items():
        result[name] = float(np.median(values))
        if name.endswith("_ratio"):
            result |= {f"{name}_low": float(values.min()), f"{name}_high": float(values.max())}
    return result


def ratios(t: Rounds, prefix: str = "") -> Rounds:
    """The seed's times over ours."""
    return {
        f"{prefix}search_ratio": t["seed_search"] / t["search"],
        f"{prefix}roi_ratio": t["seed_roi"] / t["roi"],
        f"{prefix}roi_all_ratio": t["seed_roi"] / (t["roi"] + t["refine"]),
    }


def keep_memory() -> None:
    """Have glibc keep freed images instead of returning their pages: else the kernel at its whim
    doubles the seed's time (not ours).
    """
    with contextlib.suppress(OSError, AttributeError):
        libc = ctypes.CDLL("libc.so.6")
        libc.mallopt(M_MMAP_THRESHOLD, 64 << 20)
        libc.mallopt(M_TRIM_THRESHOLD, 512 << 20)


def everywhere(searcher: Searcher, frame: Frame) -> list[Blob]:
    """Our search of a whole image."""
    image = picture(frame)
    return searcher.blobs(image, search_region.whole(image.size))


def nearby(searcher: Searcher, frame: Frame, before: Rect | None, last: Rect) -> list[Blob]:
    """Our search around the markers' hull in the last frame, given that in the one before, too."""
    image = picture(frame)
    return searcher.blobs(
        image,
        search_region.around(
            last, search_region.margin(before, last, Tracker().roi_margin_px), image.size
        ),
    )


def precision() -> dict[str, float]:
    """Both pipelines on pairs of noisy views of single tips, under changing light, before changing
    walls.
    """
    rng = np.random.default_rng(1)
    errors: dict[str, list[list[float]]] = {"ours": [], "seed": []}
    normalised: list[float] = []
    colors, settings, size = synthetic_images.ranges(), Tracker(), (64, 64)
    for n in range(VIEWS):
        name = list(synthetic_images.PAINTS)[n % len(synthetic_images.PAINTS)]
        x, y, apart = (*(32 + rng.uniform(-1, 1, 2)), rng.uniform(-1, 1))
        shape = {
            "length_px": 9 * rng.uniform(0.9, 1.3),
            "turn_rad": rng.uniform(0, 2 * np.pi),
            "light_rad": rng.uniform(-1, 1),
        }
        wall = tuple(rng.uniform(60, 200) + rng.uniform(-10, 10, 3))
        pair: dict[str, list[float]] = {"ours": [], "seed": []}
        for side in range(2):
            clean, truth = synthetic_images.clean(
                [synthetic_images.Tip(name, x + side * apart, y, 9.0, **shape)], size, wall=wall
            )
            bgr = synthetic_images.noisy(clean, NOISE, 2 * n + side)
            (ours,) = TrackerStep("left", colors, settings, size, [name]).step(
                synthetic_images.frame_of(bgr)
            ).markers or (None,)
            (seed,) = PaperFinder(colors, settings, [name]).find(
                synthetic_images.frame_of(bgr, layout="bgr")
            ) or (None,)
            for kind, marker in (("ours", ours), ("seed", seed)):
                if marker is not None:
                    pair[kind] += [marker.x_px - truth[name][0], marker.y_px - truth[name][1]]
            if ours is not None:
                normalised += [
                    (ours.x_px - truth[name][0]) / ours.sigma_px,
                    (ours.y_px - truth[name][1]) / ours.sigma_px,
                ]
        for kind, values in pair.items():
            if len(values) == 4:
                errors[kind].append(values)
    ours_px, seed_px = np.array(errors["ours"]), np.array(errors["seed"])
    return {
        "disparity_rms_px": rms(ours_px[:, 2] - ours_px[:, 0]),
        "bias_px": rms(ours_px),
        "normalised_error": rms(np.array(normalised)),
        "missed": 1.0 - len(ours_px) / VIEWS,
        "seed_disparity_rms_px": rms(seed_px[:, 2] - seed_px[:, 0]),
        "seed_bias_px": rms(seed_px),
    }


def rms(values: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def real_video(path: Path, colors: Colors) -> dict[str, float]:
    """Both pipelines over a real recording of a ball.

    Jitter is the RMS second difference of the centre's x, px.
    """
    paths: dict[str, dict[int, float]] = {"lut": {}, "paper": {}}
    steps = {
        method: TrackerStep("cam", BALL, Tracker(method=method), (640, 480), ["green"])
        for method in ("lut", "paper")
    }  # type: ignore[arg-type]
    reader, frames = VideoReader("cam", path, 30.0), []
    reader.open()
    while (frame := reader.read()) is not None:
        frames.append(replace(frame, image=synthetic_images.i420(frame.image), layout="i420"))
        for method, step in steps.items():
            markers = step.step(frame).markers
            if markers:
                paths[method][frame.seq] = markers[0].x_px
    reader.close()
    # The seed's time goes by the colours sought; the others are not in the picture, so only
    # searching the whole of it can be compared.
    six = Colors(
        colors=BALL.colors | {name: span for name, span in colors.colors.items() if name != "green"}
    )
    every = frames[:: max(1, len(frames) // 200)]
    result = told(ratios(speed(frames[:200], BALL, ["green"]), "video_one_colour_"))
    t = speed(every, six, sorted(six.colors))
    t |= {f"{name}_ms": values for name, values in t.items()} | ratios(t)
    result |= told(
        {f"video_{name}": t[name] for name in ("search_ratio", "search_ms", "seed_search_ms")}
    )
    for method in steps:
        seen = paths[method]
        second = [
            seen[n - 1] - 2 * seen[n] + seen[n + 1] for n in seen if n - 1 in seen and n + 1 in seen
        ]
        result |= {
            f"video_{method}_found": len(seen),
            f"video_{method}_jitter_px": float(np.median(np.abs(second))),
        }
    return result


def at_rest(config: RigConfig, colors: Colors, count: int) -> tuple[dict[str, float], list[str]]:
    """A hand held still: how much its tips' x scatters from frame to frame, px: ours, the seed's,
    and MediaPipe Hands' if installed.
    """
    frames = simulated(config, "still", count)
    tips = {config.hand["right"].markers[tip]: number for tip, number in TIPS.items()}
    result: dict[str, float] = {}
    for method, prefix in (("lut", ""), ("paper", "seed_")):
        step = TrackerStep(CAMERA, colors, Tracker(method=method), (640, 480), list(tips))  # type: ignore[arg-type]
        found = [
            {marker.color: marker.x_px for marker in step.step(frame).markers} for frame in frames
        ]
        result[f"{prefix}still_jitter_px"] = jitter(
            [[one.get(color, np.nan) for color in tips] for one in found]
        )
    if not importlib.util.find_spec("mediapipe"):
        return result, ["mediapipe: not installed (pip install mediapipe==0.10.21)"]
    import mediapipe

    places, times = [], defaultdict(list)
    with mediapipe.solutions.hands.Hands(max_num_hands=1) as hands:
        for frame in frames:
            rgb = cv2.cvtColor(frame.image, cv2.COLOR_YUV2RGB_I420)
            seen = timed(
                times, "ms", partial(hands.process, rgb), time.perf_counter_ns
            ).multi_hand_landmarks
            places.append(
                [seen[0].landmark[number].x * 640 if seen else np.nan for number in tips.values()]
            )
    result |= {
        "mediapipe_ms": float(np.median(times["ms"])) * 1e-6,
        "mediapipe_still_jitter_px": jitter(places),
    }
    result["mediapipe_missed"] = float(np.isnan(places).mean())
    return result, []


def jitter(places: list[list[float]]) -> float:
    """Scatter of resting points (frames, points) about their slow motion: from second differences,
    which have 1 + 4 + 1 times the variance; the median's 1 / .6745 makes it a standard deviation
    that a frame's mistake does not rule.
    """
    second = np.abs(np.diff(np.array(places), 2, axis=0))
    return float(np.sqrt(np.mean(np.nanmedian(second, axis=0) ** 2) / 6.0)) / 0.6745


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(
        description="Speed and precision of pi_tracker beside the seed's pipeline"
    )
    parser.add_argument("--frames", type=int, default=150)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    keep_memory()
    config = load_rig(ROOT / "config" / "sim.toml")
    colors = load_colors(config.calibration_dir, CAMERA)
    t = speed(simulated(config, SCENE, max(options.frames, 3 * TURN)), colors, config.colors)
    result: dict[str, Any] = (
        told(ratios(t) | {f"{name}_ms": values for name, values in t.items()}) | precision()
    )
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
