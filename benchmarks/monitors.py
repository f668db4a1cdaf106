"""What the watch over a camera's pictures costs, beside the tracker's step.

    python benchmarks/monitors.py

Pictures of six painted tips, 640 x 480 YUV420, each fresh in memory as a camera's driver leaves it.
Step and watch take turns in one process; medians and means over all pictures, since the watch does
its larger part once a second. A picture that comes again is compared as a whole.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from rhot.files.rig_tables import Tracker
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.monitors.camera_monitor import CameraMonitor
from services.pi_tracker.step import TrackerStep
from testing import synthetic_images

SIZE, FPS, PICTURES = (640, 480), 30.0, 900


def pictures() -> list[Frame]:
    """A dozen pictures with noise of their own."""
    tips = [
        synthetic_images.Tip(color, 200.0 + 45 * i, 200.0 + 30 * (i % 3))
        for i, color in enumerate(synthetic_images.PAINTS)
    ]
    clean = synthetic_images.clean(tips, SIZE)[0]
    return [
        synthetic_images.frame_of(synthetic_images.noisy(clean, 5.0, seq), seq, "i420")
        for seq in range(12)
    ]


def measure() -> dict[str, float]:
    """Times in us for one picture."""
    frames = pictures()
    names = list(synthetic_images.PAINTS)
    step = TrackerStep("left", synthetic_images.ranges(), Tracker(), SIZE, names)
    monitor = CameraMonitor("left", FPS, live=True)
    stepped, watched, again = [], [], []
    for seq in range(PICTURES):
        shot = frames[seq % len(frames)]
        frame = replace(shot, seq=seq, image=shot.image.copy())
        now_ns = round(seq * 1e9 / FPS)
        began = time.thread_time_ns()
        monitor.is_new(frame, now_ns)
        monitor.watch(frame, len(names), now_ns)
        between = time.thread_time_ns()
        step.step(frame)
        ended = time.thread_time_ns()
        monitor.is_new(replace(frame, image=frame.image.copy()), now_ns)
        again.append(time.thread_time_ns() - ended)
        watched.append(between - began)
        stepped.append(ended - between)
    return {
        "step_us": float(np.median(stepped)) * 1e-3,
        "watch_us": float(np.median(watched)) * 1e-3,
        "watch_mean_us": float(np.mean(watched)) * 1e-3,
        "again_us": float(np.median(again)) * 1e-3,
    }


def main() -> None:
    """Print the table."""
    found = measure()
    print("| of one picture | us |\n|---|---|")
    print(f"| the tracker's step, median | {found['step_us']:.0f} |")
    print(f"| the watch, median | {found['watch_us']:.1f} |")
    print(f"| the watch, mean with its part once a second | {found['watch_mean_us']:.1f} |")
    print(f"| a picture that comes again, and is not tracked | {found['again_us']:.0f} |")


if __name__ == "__main__":
    main()
