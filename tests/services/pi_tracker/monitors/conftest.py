"""Pictures with a sensor's noise, and a camera that takes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from services.pi_tracker.monitors.camera_monitor import CameraMonitor

FPS = 30.0


class Film:
    """Frames of one camera, shown to a monitor in its rhythm."""

    def __init__(self, studio, tips, size_px=(160, 120)):
        self._frames = [studio.frame(tips, seq, size_px=size_px)[0] for seq in range(8)]
        self.now_ns = 10**18

    def frame(self, number, layout="i420"):
        """The picture of one instant, with noise of its own."""
        return self._frames[number % len(self._frames)]

    def filled(self, number, luma, sigma, clip=(0, 255)):
        """A grey picture (16..235) with noise, black in its chroma."""
        frame = self.frame(number)
        rng = np.random.default_rng(number)
        image = np.full(frame.image.shape, 128.0)
        image[: frame.size_px[1]] = luma
        image += rng.normal(0.0, sigma, image.shape)
        return replace(frame, image=np.clip(image, *clip).astype(np.uint8))

    def show(self, monitor, frames, markers=2, fps=FPS):
        """Take each frame at its time; what is wrong after each second, and how many were new."""
        told, new, next_beat_ns = [], 0, self.now_ns
        for frame in frames:
            new += monitor.is_new(frame, self.now_ns)
            monitor.watch(frame, markers, self.now_ns)
            if self.now_ns >= next_beat_ns:
                told.append(monitor.beat(self.now_ns))
                next_beat_ns += 10**9
            self.now_ns += round(1e9 / fps)
        return told, new


@pytest.fixture
def film(studio, tip) -> Film:
    """A hand with two tips."""
    return Film(studio, [tip("green", 50.0, 60.0), tip("blue", 80.0, 50.0)])


@pytest.fixture
def monitor() -> CameraMonitor:
    """Of a live camera."""
    return CameraMonitor("left", FPS, live=True)
