"""Frames of a recording without stamps of its own: numbered, and stamped at a constant rate.

Or by the times that a video's container gives.
"""

from __future__ import annotations

from services.pi_tracker.image.frame import Frame, Image


class NumberedFrames:
    """Makes frames of BGR images, the n-th stamped start_ns + n / fps unless its time is given."""

    def __init__(self, camera: str, fps: float, start_ns: int) -> None:
        self.fps = fps
        self.count = 0
        self._camera = camera
        self._start_ns = start_ns

    def next(self, image: Image, time_s: float | None = None) -> Frame:
        """The next frame; image is (h, w, 3), time_s its instant after the first."""
        height, width = image.shape[:2]
        time_s = self.count / self.fps if time_s is None else time_s
        stamp_ns = self._start_ns + round(1e9 * time_s)
        frame = Frame(self._camera, self.count, stamp_ns, 0.0, (width, height), image, "bgr")
        self.count += 1
        return frame
