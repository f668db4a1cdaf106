"""Whether a camera delivers the same picture again. Pure; time is an argument.

No two pictures of a sensor are the same, since each has its own noise. One that is identical to
the last is that picture once more: a webcam that fills up its rate in the dark, or a camera that
hangs. It is told by three rows, and by all of the picture only where these are equal: 2 us a frame
instead of 60. A picture that is black or white all over has no noise and may repeat; it is dark or
saturated (picture_content.py), not frozen. Recordings may repeat, too, and are not watched.
"""

from __future__ import annotations

import numpy as np

from services.pi_tracker.image.frame import Frame, Image

# A camera that hangs, hangs for longer; a webcam that repeats each picture has another after 0.1 s.
_FROZEN_NS = 1_000_000_000


class RepeatedPicture:
    """Compares each frame of one camera with the one before."""

    def __init__(self) -> None:
        self.repeated = 0
        self._last: Frame | None = None
        self._since_ns: int | None = None

    def update(self, frame: Frame, now_ns: int) -> bool:
        """Take in a frame; whether it shows the same picture as the last."""
        last, self._last = self._last, frame
        if last is None or not _same(last.image, frame.image):
            self._since_ns = None
            return False
        self.repeated += 1
        if self._since_ns is None:
            self._since_ns = now_ns
        return True

    def frozen_s(self, now_ns: int) -> float:
        """For how long the camera has been frozen, 0 if it is not."""
        if self._since_ns is None or now_ns - self._since_ns < _FROZEN_NS:
            return 0.0
        return (now_ns - self._since_ns) * 1e-9


def _same(one: Image, other: Image) -> bool:
    if one.shape != other.shape:
        return False
    height = one.shape[0]
    # Quarters of an I420 image: two rows of luma, one of chroma.
    for row in (height // 2, height // 4, 3 * height // 4):
        if one[row].tobytes() != other[row].tobytes():
            return False
    return bool(np.array_equal(one, other))
