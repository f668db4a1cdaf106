"""Writes a video that browsers and phones play: VP8 in WebM, by the FFmpeg inside OpenCV's wheels.

A webcam's video of 640 x 480: 69 pictures a second of processor time, 9 MB a minute; VP9 manages 10
with a file that is no smaller, and H.264 is in no wheel of OpenCV, which lets nobody choose the bit
rate either (pictures full of noise become sixteen times as large).
"""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Self

import cv2

from rhot.errors import CaptureError, DiskFullError, RhotError
from services.pi_tracker.image.frame import Image
from services.pi_tracker.sources.video_decoder import VideoDecoder, silenced_opencv

_CODEC = "VP80"
# OpenCV picks the container by the name's end.
_UNFINISHED = ".partial.webm"
# The encoder does not say that the disk is full; a video of 1280 x 720 grows by .3 MB a second.
_MIN_FREE_BYTES = 2_000_000
# A WebM's header tells its duration, from which OpenCV estimates the count.
_SLACK_FRAMES = 2
# The longer side of a video: larger pictures are made smaller. Encoding is what takes time, and
# takes as long a pixel: 960 x 540 shows every joint of a hand and the legend.
_MAX_SIDE_PX = 960


def video_size(size_px: tuple[int, int]) -> tuple[int, int]:
    """The size that pictures of a size (width, height) have in a video: no larger, and even."""
    scale = min(1.0, _MAX_SIDE_PX / max(size_px))
    # Chroma is stored for every second pixel.
    return round(scale * size_px[0]) // 2 * 2, round(scale * size_px[1]) // 2 * 2


class WebmWriter:
    """Context manager: pictures of one size in, the file under its name once it is complete.

    A run that fails or is interrupted leaves what was there before.
    """

    def __init__(self, path: Path, size_px: tuple[int, int], hz: float) -> None:
        self._path, self._size_px, self._hz = path, size_px, hz
        self._unfinished = path.with_name(path.stem + _UNFINISHED)
        self._count = 0
        self._video: cv2.VideoWriter | None = None

    def __enter__(self) -> Self:
        codec = cv2.VideoWriter_fourcc(*_CODEC)  # type: ignore[attr-defined]
        name = str(self._unfinished)
        with _silent_standard_error(), silenced_opencv():
            self._video = cv2.VideoWriter(name, cv2.CAP_FFMPEG, codec, self._hz, self._size_px)
        if not self._video.isOpened():
            raise self._failure(f"this OpenCV ({cv2.__version__}) may have no VP8 encoder")
        return self

    def write(self, image: Image) -> None:
        """The next picture, (h, w, 3) BGR. Raises DiskFullError."""
        if self._video is None:
            raise self._failure("it is not open")
        if shutil.disk_usage(self._path.parent).free < _MIN_FREE_BYTES:
            raise DiskFullError(f"{self._path}: cannot be written: No space left on device")
        with silenced_opencv():
            self._video.write(image)
        self._count += 1

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        try:
            if self._video is not None:
                with silenced_opencv():
                    self._video.release()
            if error is None:
                self._check()
                self._unfinished.replace(self._path)
        finally:
            self._unfinished.unlink(missing_ok=True)

    def _check(self) -> None:
        """Raises CaptureError unless the file holds all pictures: the encoder tells no errors."""
        decoder = VideoDecoder(self._unfinished)
        try:
            decoder.open()
            whole = abs(decoder.frame_count - self._count) <= _SLACK_FRAMES
        except RhotError:
            whole = False
        finally:
            decoder.close()
        if not whole:
            raise self._failure("the disk may be full, or files be limited in size (`ulimit -f`)")

    def _failure(self, cause: str) -> CaptureError:
        return CaptureError(f"{self._path}: the video cannot be written; {cause}")


@contextlib.contextmanager
def _silent_standard_error() -> Iterator[None]:
    """OpenCV prints that WebM knows no tags of codecs, whichever it is given, past its own log."""
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
