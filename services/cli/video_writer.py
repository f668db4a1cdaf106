"""A video that browsers play: VP8 in a .webm, written by OpenCV picture by picture.

VP9 files are a third as large, and take OpenCV twice as long: .24 s of CPU a picture of 1280x720,
VP8 .12 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy.typing as npt

from rhot.errors import CaptureError

SUFFIX = ".webm"
_CODE = "VP80"
# Wider pictures are made smaller: half the time of 1280 px, and text can still be read.
_WIDEST_PX = 960
# Where one picture has no rate.
_FPS = 30.0


def rate_of(times_s: Sequence[float]) -> float:
    """Pictures a second of instants, so that the video lasts as long as they do."""
    lasts_s = times_s[-1] - times_s[0] if len(times_s) > 1 else 0.0
    return (len(times_s) - 1) / lasts_s if lasts_s > 0.0 else _FPS


class VideoWriter:
    """Writes pictures (h, w, 3), BGR, of one size; close() ends the file.

    Raises CaptureError where the file cannot be written.
    """

    def __init__(self, path: Path, fps: float, size_px: tuple[int, int]) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, self._size_px = path, size_px
        shrunk = min(1.0, _WIDEST_PX / size_px[0])
        # Both even, as the codec wants.
        width, height = (max(2, 2 * round(0.5 * shrunk * px)) for px in size_px)
        self._written_px = (width, height)
        code = cv2.VideoWriter.fourcc(*_CODE)
        self._writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, fps, self._written_px)
        if not self._writer.isOpened():
            raise CaptureError(
                f"{path}: a video of {size_px[0]}x{size_px[1]} px cannot be written: is the folder "
                "writable, and was OpenCV built with FFmpeg (pip's opencv-python-headless is)?"
            )

    def write(self, image: npt.NDArray[Any]) -> None:
        """The next picture."""
        height, width = image.shape[:2]
        if (width, height) != self._size_px:
            raise CaptureError(
                f"{self._path}: a picture of {width}x{height} px in a video of "
                f"{self._size_px[0]}x{self._size_px[1]}"
            )
        if self._written_px != self._size_px:
            image = cv2.resize(image, self._written_px, interpolation=cv2.INTER_AREA)
        self._writer.write(image)

    def close(self) -> None:
        """Ends the file."""
        self._writer.release()
