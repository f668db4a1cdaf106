"""A video file as a frame source, with stamps from the frame's number and the file's frame rate.

A file that does not exist or cannot be decoded, and one that ends before the frames its header
promises, raise CaptureError saying how many frames there were of how many. A video of unknown frame
rate takes the rate of its [[camera]] table.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import cv2

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Frame, Image

# Headers of several containers give the duration only, from which OpenCV estimates the count; two
# frames or 2 % off is still whole.
_SLACK_FRAMES, _SLACK = 2, 0.02
# Below and above this no camera's video can be; such a rate is a broken header.
_FPS_RANGE = (0.1, 1000.0)
# LOG_LEVEL_SILENT
_SILENT = 0
_GREY = {int.from_bytes(code, "little") for code in (b"Y800", b"GREY", b"Y8  ")}


class VideoReader:
    """Frames of one video file. start_ns is the stamp of its first frame."""

    live = False

    def __init__(self, camera: str, path: Path, fps: float, start_ns: int = 0) -> None:
        self.notes: list[str] = []
        self._camera = camera
        self._path = path
        self._fps = fps
        self._start_ns = start_ns
        self._decoder = Decoder(path)
        self._seq = 0

    def open(self) -> None:
        self._decoder.open()
        if _FPS_RANGE[0] <= self._decoder.fps <= _FPS_RANGE[1]:
            self._fps = self._decoder.fps

    def read(self) -> Frame | None:
        image = self._decoder.read()
        if image is None:
            self._decoder.check_end(self._seq)
            return None
        stamp_ns = self._start_ns + round(self._seq * 1e9 / self._fps)
        frame = Frame(
            self._camera, self._seq, stamp_ns, 0.0, (image.shape[1], image.shape[0]), image, "bgr"
        )
        self._seq += 1
        return frame

    def close(self) -> None:
        self._decoder.close()


class Decoder:
    """OpenCV's decoder with errors that say what is wrong with the file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._capture: cv2.VideoCapture | None = None
        self.fps = 0.0
        self.promised = 0
        self.grey = False

    def open(self) -> None:
        if not self._path.is_file():
            raise CaptureError(f"{self._path}: no such video file")
        with _quiet():
            self._capture = cv2.VideoCapture(str(self._path), cv2.CAP_FFMPEG)
        if not self._capture.isOpened():
            raise CaptureError(
                f"{self._path}: cannot be decoded: not a video, or cut short (an mp4 has its index at the end). "
                "Try `ffprobe` on it, and copy or record it again"
            )
        self.fps = float(self._capture.get(cv2.CAP_PROP_FPS))
        self.promised = max(0, int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT)))
        self.grey = int(self._capture.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT)) in _GREY
        if self.grey:
            self._capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)

    def read(self) -> Image | None:
        """The next image: BGR (h, w, 3), or grey (h, w) of a grey video; None at the end."""
        if self._capture is None:
            return None
        ok, image = self._capture.read()
        return image if ok else None

    def check_end(self, count: int) -> None:
        """Raise CaptureError if a file that ended after count frames had promised more."""
        if count == 0:
            raise CaptureError(f"{self._path}: holds no frame that can be decoded")
        if count + max(_SLACK_FRAMES, _SLACK * self.promised) < self.promised:
            raise CaptureError(
                f"{self._path}: ends after {count} of {self.promised} frames: cut short or damaged"
            )

    def close(self) -> None:
        if self._capture is not None:
            self._capture.release()
            self._capture = None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Without OpenCV's and FFmpeg's own words on a broken file, which would come before ours on the
    raw standard error.
    """
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    # OpenCV 4.10 has setLogLevel beside imread, later ones in a module of its own.
    logging = getattr(cv2.utils, "logging", cv2)
    level = logging.setLogLevel(_SILENT)
    try:
        yield
    finally:
        logging.setLogLevel(level)
