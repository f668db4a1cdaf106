"""Speed of pi_tracker and of the RHOT paper's pipeline over the same pictures, stage by stage.

Part of benchmarks/tracker.py, which says what the stages are. The two take turns, so that changes
in the machine's speed affect both. Our pictures are the camera's YUV420, the paper's BGR, whose
conversion is not counted.
"""

from __future__ import annotations

import contextlib
import ctypes
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import cv2
import msgspec
import numpy as np
import numpy.typing as npt

from rhot.files.calibration import Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.paper_finder import PaperFinder
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import picture
from services.pi_tracker.step import TrackerStep

# After a change of turns the first pictures take up to three times as long, ours more than the
# paper's: the caches hold the other's data. A tracker that runs has no such turns; in 30 pictures
# they weigh little.
TURN, ROUNDS = 30, 5
# glibc's malloc.h
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3

# Durations of each stage, ns.
Times = dict[str, list[int]]
# One value per round.
Rounds = dict[str, npt.NDArray[np.float64]]


def timed(
    times: Times, name: str, work: Callable[[], Any], clock: Callable[[], int] = time.thread_time_ns
) -> Any:
    """Run once and note how long it took."""
    started = clock()
    result = work()
    times[name].append(clock() - started)
    return result


def speed(frames: list[Frame], colors: Colors, color_names: Sequence[str]) -> Rounds:
    """Both pipelines over frames that show all colours, stage by stage in turns.

    Medians of each round in ms.
    """
    times: Times = defaultdict(list)
    detector = BlobDetector(compile_colors(colors, color_names), Tracker())
    step = TrackerStep("left", colors, Tracker(), (640, 480), color_names, time.thread_time_ns)
    tracking = PaperFinder(colors, Tracker(), color_names)
    for start in range(0, len(frames), TURN):
        ours = frames[start : start + TURN]
        theirs = [_as_bgr(frame) for frame in ours]
        _time_search(times, detector, ours)
        _time_step(times, step, ours)
        for frame in map(_fresh_copy, theirs):
            lost = PaperFinder(colors, Tracker(), color_names)
            timed(times, "seed_search", partial(lost.find, frame))
        for frame in map(_fresh_copy, theirs):
            timed(times, "seed_roi", partial(tracking.find, frame))
    # The first frames of all warm the machine up.
    parts = {name: np.array_split(values[TURN // 2 :], ROUNDS) for name, values in times.items()}
    return {
        name: np.array([np.median(part) for part in rounds]) * 1e-6
        for name, rounds in parts.items()
    }


def _time_search(times: Times, detector: BlobDetector, frames: list[Frame]) -> None:
    """Our search of whole images, then around the markers of the last two."""
    found = [
        timed(times, "search", partial(_search_whole, detector, frame))
        for frame in map(_fresh_copy, frames)
    ]
    rects = [
        search_region.bounding_rect(blob.rect for blob in blobs) if blobs else None
        for blobs in found
    ]
    for frame, before, last in zip(map(_fresh_copy, frames[2:]), rects, rects[1:], strict=False):
        if last:
            timed(times, "roi", partial(_search_around, detector, frame, before, last))


def _time_step(times: Times, step: TrackerStep, frames: list[Frame]) -> None:
    """Our whole step with encoding, and the centroids' part of it."""
    encoder = msgspec.json.Encoder()
    for frame in map(_fresh_copy, frames):

        def encoded(frame: Frame = frame) -> bytes:
            return encoder.encode(step.step(frame))

        timed(times, "step", encoded, time.perf_counter_ns)
        times["refine"].append(round(step.times_ms["centroid"] * 1e6))


def _as_bgr(frame: Frame) -> Frame:
    """The same picture as the paper's camera delivers it."""
    return replace(frame, image=cv2.cvtColor(frame.image, cv2.COLOR_YUV2BGR_I420), layout="bgr")


def _fresh_copy(frame: Frame) -> Frame:
    """The frame just written to memory, as a camera's driver leaves it."""
    return replace(frame, image=frame.image.copy())


def _search_whole(detector: BlobDetector, frame: Frame) -> list[Blob]:
    image = picture(frame)
    return detector.detect(image, search_region.whole(image.size))


def _search_around(
    detector: BlobDetector, frame: Frame, before: Rect | None, last: Rect
) -> list[Blob]:
    """Search around the markers' rectangle in the last frame, given that in the one before, too."""
    image = picture(frame)
    margin_px = search_region.motion_margin(before, last, Tracker().roi_margin_px)
    return detector.detect(image, search_region.around(last, margin_px, image.size))


def summarised(rounds: Rounds) -> dict[str, float]:
    """The median of the rounds, and how far ratios range."""
    result: dict[str, float] = {}
    for name, values in rounds.items():
        result[name] = float(np.median(values))
        if name.endswith("_ratio"):
            result |= {f"{name}_low": float(values.min()), f"{name}_high": float(values.max())}
    return result


def ratios(times: Rounds, prefix: str = "") -> Rounds:
    """The paper's times over ours."""
    return {
        f"{prefix}search_ratio": times["seed_search"] / times["search"],
        f"{prefix}roi_ratio": times["seed_roi"] / times["roi"],
        f"{prefix}roi_all_ratio": times["seed_roi"] / (times["roi"] + times["refine"]),
    }


def keep_memory() -> None:
    """Have glibc keep freed images instead of returning their pages to the kernel.

    Else the paper's time doubles now and then (not ours).
    """
    with contextlib.suppress(OSError, AttributeError):
        libc = ctypes.CDLL("libc.so.6")
        libc.mallopt(_M_MMAP_THRESHOLD, 64 << 20)
        libc.mallopt(_M_TRIM_THRESHOLD, 512 << 20)
