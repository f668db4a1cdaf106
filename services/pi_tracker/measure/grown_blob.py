"""A marker's blob, grown into what is nearly its colour: two thresholds and what is connected, as
Canny's edges have it (IEEE Trans. PAMI 8(6), 1986). Pure.

Half of a marker that no person would miss may lie outside its range by a hue or two, another half
in each picture: its centre jumps by pixels, in each camera differently. What is connected with a
blob and nearly of its colour is the same paint, unless it is more than the marker can have.

Thin bridges do not connect: what is near must fill squares of two cells a side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import cv2
import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.blob import Blob, make_blob
from services.pi_tracker.image.compiled_colors import CompiledColors
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.morphology import opening
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture

# A blob grows to so many times its cells at most, or those that were found of its marker a moment
# ago; or to so much of what its marker is where all of it shows; whichever is more. (Limits by what
# it had just grown to let it grow on over skin.) Without the latter a dab of which 5 of 50 cells
# were in its range stayed at these, 4 px off: 16 tuning clips of the other renderer, geometric mean
# of what centres jump by .28 -> .26 px, of points' largest errors without lag 17.0 -> 14.5 mm.
# (With .85 two of five clips were as before.)
_MOST_TIMES, _MOST_OF_WHOLE = 2.5, 0.95
# Cells beside the blob that are looked at: of a marker as large as it was a moment ago, or as the
# blob may become, so much longer than a square, what the blob does not have; within these bounds.
# (By what it is where all of it shows, more of a poster was looked at: a tip 26 -> 34 mm off.)
_LONG, _REACH = 1.3, (3, 24)
# A blob of this share of the cells that its marker has where all of it shows is left as it is: some
# cells of the rim are in no range. Tuning half of the other renderer, what a centre jumps by from
# frame to frame, of a grasp and of a hand that rolls, before limits were what they are: .83 and .22
# px ungrown, .31 and .16 with .65, .24 and .10 with .8, .23 and .09 with .85, .21 and .09 with all
# blobs grown, which takes 20 us more a frame.
_WHOLE = 0.85


class Classes(Protocol):
    """Colours of cells, as detect/color_table.py has them."""

    @property
    def layers(self) -> Sequence[npt.NDArray[np.uint32]]:
        """(65536,) each."""

    def classify(self, luma: Image, chroma: Image) -> Image:
        """The class of every cell, 0 for none."""


class NearPaint:
    """What is nearly the colour of each paint."""

    def __init__(self, table: Classes) -> None:
        self.table = table
        self.in_c = CompiledColors(table.layers)


class Limit(NamedTuple):
    """How a blob may grow: to how many cells (0: it stays as it is), of so many around it."""

    most: int
    reach: int


NO_GROWTH = Limit(0, 0)


class Growth(NamedTuple):
    """How blobs of a picture may grow, each by its limit."""

    near: NearPaint
    limits: Sequence[Limit]


def limit(blob: Blob, marker_px2: float, whole_px2: float, found_px2: float) -> Limit:
    """Of a blob whose marker had such an area a moment ago, has such a one where all of it shows,
    and had such a blob; 0: nobody knows.
    """
    had, whole = 0.25 * marker_px2, 0.25 * whole_px2
    if whole and blob.cells >= _WHOLE * whole:
        return NO_GROWTH
    most = max(_MOST_TIMES * max(blob.cells, 0.25 * found_px2), _MOST_OF_WHOLE * whole)
    x0, y0, x1, y1 = blob.rect
    least, farthest = _REACH
    missing = math.ceil(_LONG * math.sqrt(had or most)) - min(x1 - x0, y1 - y0)
    return Limit(round(most), min(max(missing, least), farthest))


def grown(picture: Picture, near: Classes, blob: Blob, by: Limit) -> Blob:
    """A blob with what it grows into; itself if that is nothing or too much."""
    if not by.most:
        return blob
    x0, y0, x1, y1 = blob.rect
    left, top = max(x0 - by.reach, 0), max(y0 - by.reach, 0)
    right, bottom = min(x1 + by.reach, picture.size[0]), min(y1 + by.reach, picture.size[1])
    own = np.zeros((bottom - top, right - left), np.uint8)
    own[y0 - top : y1 - top, x0 - left : x1 - left] = blob.mask != 0
    classes = near.classify(*picture.cells((left, top, right, bottom)))
    alike = own | (classes == blob.color + 1).view(np.uint8)
    # An empty column keeps the ends of rows apart, which `opening` sees side by side.
    spaced = np.ascontiguousarray(np.pad(alike, ((0, 0), (0, 1))))
    _, labels = cv2.connectedComponents(own | opening(spaced, 1, 1)[:, :-1], connectivity=8)
    mask = np.isin(labels, labels[own != 0]).astype(np.uint8)
    cells = cv2.countNonZero(mask)
    if not cv2.countNonZero(own) < cells <= by.most:
        return blob
    x, y, w, h = cv2.boundingRect(mask)
    rect = (left + x, top + y, left + x + w, top + y + h)
    if _goes_on(rect, (left, top, right, bottom), picture.size):
        return blob
    return make_blob(blob.color, rect, np.ascontiguousarray(mask[y : y + h, x : x + w]), cells)


def _goes_on(rect: Rect, window: Rect, size: tuple[int, int]) -> bool:
    """Whether what has a rectangle in a window of a picture goes on beyond the window."""
    inner = window[0] > 0, window[1] > 0, window[2] < size[0], window[3] < size[1]
    return any(edge and at == limit for edge, at, limit in zip(inner, rect, window, strict=True))
