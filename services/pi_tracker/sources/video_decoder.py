"""OpenCV's video decoder, with errors that say what is wrong with the file."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import cv2

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Image
from services.pi_tracker.sources.container_size import announced_size

# Where the container does not tell its size: headers of several give the duration only, from which
# OpenCV estimates the count; two frames or 2 % off is still whole.
_SLACK_FRAMES, _SLACK_SHARE = 2, 0.02
# LOG_LEVEL_SILENT
_SILENT = 0
_GREY_FORMATS = {int.from_bytes(code, "little") for code in (b"Y800", b"GREY", b"Y8  ")}


class VideoDecoder:
    """Decodes one file, frame after frame."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._capture: cv2.VideoCapture | None = None
        # Known once it is open. frame_count is what the header announces, 0 if nothing.
        self.fps = 0.0
        self.frame_count = 0
        self.grey = False
        # When the latest image is to be shown, by the container, s after the first; 0 where the
        # file holds no times.
        self.time_s = 0.0

    def open(self) -> None:
        if not self._path.is_file():
            raise CaptureError(f"{self._path}: no such video file")
        with silenced_opencv():
            self._capture = cv2.VideoCapture(str(self._path), cv2.CAP_FFMPEG)
        if not self._capture.isOpened():
            raise CaptureError(
                f"{self._path}: cannot be decoded: not a video, or cut short (an mp4 has its index "
                "at the end). Try `ffprobe` on it, and copy or record it again"
            )
        self.fps = float(self._capture.get(cv2.CAP_PROP_FPS))
        self.frame_count = max(0, int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT)))
        self.grey = int(self._capture.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT)) in _GREY_FORMATS
        if self.grey:
            self._capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)

    def read(self) -> Image | None:
        """The next image: BGR (h, w, 3), or grey (h, w) of a grey video; None at the end."""
        if self._capture is None:
            return None
        ok, image = self._capture.read()
        self.time_s = 1e-3 * float(self._capture.get(cv2.CAP_PROP_POS_MSEC))
        return image if ok else None

    def check_end(self, count: int) -> None:
        """Raise CaptureError if the end of a file, of which count frames came, is missing.

        A trimmed video gives fewer frames than it holds: that is no damage.
        """
        if count == 0:
            raise CaptureError(f"{self._path}: holds no frame that can be decoded")
        announced = announced_size(self._path)
        if announced is None:
            slack = max(_SLACK_FRAMES, _SLACK_SHARE * self.frame_count)
            cut_short = count + slack < self.frame_count
        else:
            cut_short = self._path.stat().st_size < announced
        if cut_short:
            raise CaptureError(
                f"{self._path}: ends after {count} of {self.frame_count} frames: "
                "cut short or damaged"
            )

    def close(self) -> None:
        if self._capture is not None:
            self._capture.release()
            self._capture = None


@contextlib.contextmanager
def silenced_opencv() -> Iterator[None]:
    """Without OpenCV's and FFmpeg's own messages on a broken file.

    They would come before ours, on the raw standard error.
    """
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    # OpenCV 4.10 has setLogLevel beside imread, later ones in a module of its own.
    logging = getattr(cv2.utils, "logging", cv2)
    level = logging.setLogLevel(_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(level)
