"""Frames of a recording without stamps of its own: numbered, and stamped at a constant rate."""

from __future__ import annotations

from services.pi_tracker.image.frame import Frame, Image


class NumberedFrames:
    """Makes frames of BGR images, the n-th stamped start_ns + n / fps."""

    def __init__(self, camera: str, fps: float, start_ns: int) -> None:
        self.fps = fps
        self.count = 0
        self._camera = camera
        self._start_ns = start_ns

    def next(self, image: Image) -> Frame:
        """The next frame; image is (h, w, 3)."""
        height, width = image.shape[:2]
        stamp_ns = self._start_ns + round(self.count * 1e9 / self.fps)
        frame = Frame(self._camera, self.count, stamp_ns, 0.0, (width, height), image, "bgr")
        self.count += 1
        return frame
