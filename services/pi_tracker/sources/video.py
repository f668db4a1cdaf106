"""A video file as a frame source, stamped by the times in its container.

Phones record at a variable rate, so that a frame's number tells its instant to some 50 ms only. The
container holds the time at which each frame is to be shown, to a millisecond or better. A rate
given by hand takes their place; so does the file's frame rate, or that of the [[camera]] table,
where a file holds no times.

A file that does not exist or cannot be decoded, and one whose end is missing, raise CaptureError
saying how many frames there were of how many.
"""

from __future__ import annotations

from pathlib import Path

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.notes import Notes
from services.pi_tracker.sources.numbered_frames import NumberedFrames
from services.pi_tracker.sources.video_decoder import VideoDecoder

# Below and above this no camera's video can be; such a rate is a broken header.
_FPS_RANGE = (0.1, 1000.0)


class VideoReader:
    """Frames of one video file. start_ns is the stamp of its first frame."""

    live = False

    def __init__(
        self, camera: str, path: Path, fps: float, start_ns: int = 0, rate: float | None = None
    ) -> None:
        """fps: the rate where the file says none; rate: the one to take whatever the file says."""
        self.notes = Notes(camera)
        self._path = path
        self._decoder = VideoDecoder(path)
        self._frames = NumberedFrames(camera, rate or fps, start_ns)
        self._has_times = rate is None
        self._last_s = 0.0

    def open(self) -> None:
        self._decoder.open()
        if self._has_times and _FPS_RANGE[0] <= self._decoder.fps <= _FPS_RANGE[1]:
            self._frames.fps = self._decoder.fps

    def read(self) -> Frame | None:
        image = self._decoder.read()
        if image is None:
            self._decoder.check_end(self._frames.count)
            return None
        if self._frames.count == 1 and self._decoder.time_s <= 0.0:
            self._has_times = False  # pictures without times, as of raw H.264
        return self._frames.next(image, self._time_s() if self._has_times else None)

    def _time_s(self) -> float:
        """When the latest image is to be shown, s after the first."""
        if self._frames.count == 0:
            return 0.0
        time_s = self._decoder.time_s
        if time_s <= self._last_s:
            raise CaptureError(
                f"{self._path}: frame {self._frames.count} is to be shown at {time_s:.3f} s, not "
                f"later than the one before ({self._last_s:.3f} s): its times are damaged; give "
                "its frame rate by hand (`rhot track --fps`)"
            )
        self._last_s = time_s
        return time_s

    def close(self) -> None:
        self._decoder.close()
