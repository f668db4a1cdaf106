"""Whether a camera's picture is black, or much of it white. Pure; time is an argument.

Eight rows of cells tell, once a second: 0.1 ms then, 4 us a frame. A picture in which markers are
found is not black, however dark the rest of the room.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import picture

# Light changes in seconds, and nobody needs to hear of it sooner.
_PERIOD_NS = 1_000_000_000
_ROWS = 8
# Luma (16..235) below which paint is as dark as its noise: value 28, where no range begins lower
# than 25 (colors/bounds.py). A covered sensor at full gain stays below with 99 % of its cells; a
# hand at the far end of the volume covers 2 % of the picture.
_DARK_LUMA, _DARK_SHARE = 40.0, 0.99
# RGB 250, of which exposure_advice.py says that it tells nothing of a colour. A window behind the
# hand takes a third of the picture, and the rest is as good as ever.
_WHITE_LUMA, _MAX_WHITE = 231.0, 0.4
# A hand before the lens for a moment, and headlights of a car that passes, are no news.
_CHECKS = 2

Content = Literal["camera_dark", "camera_saturated", ""]


class PictureContent:
    """What is wrong with one camera's pictures: the code of a fault, "" if nothing is."""

    def __init__(self) -> None:
        self.code: Content = ""
        # Figures of the last check, for the fault's text.
        self.luma = 0.0
        self.white = 0.0
        self._due_ns: int | None = None
        self._seen: Content = ""
        self._count = 0

    def update(self, frame: Frame, markers: int, now_ns: int) -> None:
        """Take in a frame, in which so many markers were found."""
        # A clock that was set back counts as due.
        if self._due_ns is not None and 0 < self._due_ns - now_ns <= _PERIOD_NS:
            return
        self._due_ns = now_ns + _PERIOD_NS
        found = self._check(frame, markers)
        self._count = self._count + 1 if found == self._seen else 1
        self._seen = found
        if self._count >= _CHECKS:
            self.code = found

    def _check(self, frame: Frame, markers: int) -> Content:
        image = picture(frame)
        width, height = image.size
        step = max(1, height // _ROWS)
        luma = np.concatenate(
            [image.cells((0, y, width, y + 1))[0] for y in range(step // 2, height, step)]
        )
        brightest = round(_DARK_SHARE * (luma.size - 1))
        self.luma = float(np.partition(luma.ravel(), brightest)[brightest])
        self.white = float(np.count_nonzero(luma >= _WHITE_LUMA)) / luma.size
        if self.luma < _DARK_LUMA and not markers:
            return "camera_dark"
        return "camera_saturated" if self.white > _MAX_WHITE else ""
