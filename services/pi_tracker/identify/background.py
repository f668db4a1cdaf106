"""Background subtraction: removes static background in a marker's colour from blobs, cell by cell.

So a marker is seen that is in front of such an object or beside it. Pure. Only blobs that were not
taken for a marker are learnt, with the cells about them, where they stay the same for a few
sightings. A cell that differs from its mean is foreground, such as a marker that passes. What looks
like known cells beside it is known, too (uncovered_cells.py). Nothing is known at the start. An
object that is removed is forgotten. Where the light changes, or the camera is moved, everything is
learnt again. A picture of another size starts a new model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from services.pi_tracker.identify.cell_colors import Gate, agree, agree_with, slices, yuv
from services.pi_tracker.identify.uncovered_cells import with_uncovered
from services.pi_tracker.image.blob import Blob, blobs_of_contours, external_contours
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture

# Sightings in a row before a cell counts as static: a tenth of a second at 30 fps, too long for a
# moving finger. And how many are remembered, so that an object is known as soon as the hand in
# front of it is gone.
_STATIC_SIGHTINGS, _MAX_SIGHTINGS = 4, 16
# A sighting that differs counts twice against it.
_MISMATCH_COST = 2
# A cell agrees with its mean when luma, U and V are within this many of their standard deviations,
# and a little for shadows. Five, because not one of an object's thousand cells should differ.
_GATE: Gate = 5.0, 3.0
# The same where means of many looks are compared, of which one alone is not.
_MEAN_GATE: Gate = 2.5, 1.0
# Weight of a new sighting in the mean.
_NEW_WEIGHT = 0.2
# A blob of which less than this share is background is a marker whose rim touches it: left as it
# is.
_RIM_SHARE = 0.1
# What is left of a blob, in cells, to be examined: shadows and the shimmer of edges leave less.
_MIN_CELLS = 6
# An object not seen for one to two such times is gone, or hidden for good.
_FORGET_NS = 30_000_000_000
_SQUARE, _RIM = np.ones((2, 2), np.uint8), np.ones((3, 3), np.uint8)
# Blobs are compared with what is known within so many cells of them, with every so many-th of it.
_AROUND_CELLS, _AROUND_STEP = 32, 2


class BackgroundModel:
    """The static background of one camera, as far as it has a marker's colour."""

    def __init__(self) -> None:
        self._size = (0, 0)
        self._mean = np.empty((0, 0, 3), np.float32)  # (h, w, 3) Y, U, V
        self._sightings = np.empty((0, 0), np.int16)  # (h, w) 0 where nothing is known
        self._seen_since_sweep = np.empty((0, 0), bool)
        self._swept_ns = 0
        self._empty = True
        # The cells of a picture that were looked at last.
        self._seen: _Seen | None = None
        # Whether no cell waits for more sightings.
        self.settled = True

    def foreground(self, image: Picture, blobs: Sequence[Blob], noise: Noise) -> list[Blob]:
        """What of the blobs is not static background.

        Those without any background in them are the same objects.
        """
        if self._empty or image.size != self._size:
            return list(blobs)
        touching = [self._touches(blob) for blob in blobs]
        if not any(touching):
            return list(blobs)
        # The cells of all of them at once, not of each blob by itself.
        rect = _bounds([blob.rect for blob, on in zip(blobs, touching, strict=True) if on])
        seen = _Seen(image, rect, yuv(image, rect))
        static = self._sightings[slices(rect)] >= _STATIC_SIGHTINGS
        static &= agree(seen.yuv, self._mean[slices(rect)], noise, _GATE)
        self._seen = seen
        return [
            part
            for blob, on in zip(blobs, touching, strict=True)
            for part in (_foreground_of(blob, seen, static, noise) if on else [blob])
        ]

    def _touches(self, blob: Blob) -> bool:
        """Whether anything static is known where a blob is."""
        return bool((self._sightings[slices(blob.rect)] >= _STATIC_SIGHTINGS).any())

    def _yuv(self, image: Picture, rect: Rect) -> Image:
        """As cell_colors.yuv."""
        seen = self._seen
        if seen is None or seen.image is not image or not _is_inside(rect, seen.rect):
            return yuv(image, rect)
        return seen.yuv[slices(_from(seen.rect, rect))]

    def resembles(self, image: Picture, blob: Blob, noise: Noise) -> bool:
        """Whether a blob has the colour of static background around it: a part not known yet."""
        if self._empty or image.size != self._size:
            return False
        x0, y0, x1, y1 = blob.rect
        around = (
            slice(max(y0 - _AROUND_CELLS, 0), y1 + _AROUND_CELLS, _AROUND_STEP),
            slice(max(x0 - _AROUND_CELLS, 0), x1 + _AROUND_CELLS, _AROUND_STEP),
        )
        static = self._sightings[around] >= _STATIC_SIGHTINGS
        if 2 * _AROUND_STEP**2 * np.count_nonzero(static) < blob.cells:
            return False
        color = np.array(cv2.mean(self._yuv(image, blob.rect), blob.mask)[:3])
        alike = agree_with(self._mean[around], color, noise, _MEAN_GATE)
        return bool(2 * _AROUND_STEP**2 * np.count_nonzero(alike & static) >= blob.cells)

    def update(
        self,
        image: Picture,
        region: Rect,
        blobs: Sequence[Blob],
        markers: Sequence[Rect],
        noise: Noise,
        stamp_ns: int,
    ) -> None:
        """Take in all blobs detected in a region, but not where markers are, and about them."""
        if image.size != self._size:
            self._reset(image.size, stamp_ns)
        if not 0 <= stamp_ns - self._swept_ns < _FORGET_NS:
            self._sightings[~self._seen_since_sweep] = 0
            self._seen_since_sweep[:] = False
            self._swept_ns = stamp_ns
        seen = _with_rims(blobs, region)
        for marker in markers:
            _exclude(seen, region, marker)
        self._learn(image, region, seen, noise)

    def _reset(self, size: tuple[int, int], stamp_ns: int) -> None:
        width, height = size
        self._size, self._swept_ns, self._empty = size, stamp_ns, True
        self._mean = np.zeros((height, width, 3), np.float32)
        self._sightings = np.zeros((height, width), np.int16)
        self._seen_since_sweep = np.zeros((height, width), bool)

    def _learn(self, image: Picture, region: Rect, seen: Image, noise: Noise) -> None:
        """Count a sighting of the cells `seen` (h, w) of a region, and move their mean.

        Of those that wait, whatever colour noise gave them now, it is one where they look the same.
        """
        part = slices(region)
        sightings = self._sightings[part]
        waiting = (sightings > 0) & (sightings < _STATIC_SIGHTINGS)
        rows, columns = np.nonzero(seen | waiting)
        if not len(rows):
            self.settled = True
            return
        self._empty = False
        luma, chroma = image.cells(region)
        now = np.column_stack((luma[rows, columns], chroma[rows, columns])).astype(np.float32)
        mean, count, own = self._mean[part], sightings[rows, columns], seen[rows, columns]
        before = mean[rows, columns]
        agrees = (count > 0) & agree(now[:, None], before[:, None], noise, _GATE)[:, 0]
        counted = np.where(agrees, np.minimum(count + 1, _MAX_SIGHTINGS), count - _MISMATCH_COST)
        replaced = counted <= 0
        after = np.where(agrees[:, None], before + _NEW_WEIGHT * (now - before), before)
        after[replaced] = now[replaced]
        mean[rows, columns] = after
        # What waited, and has changed without being seen, is forgotten.
        counted = np.where(own, np.maximum(counted, 1), np.where(agrees, counted, 0))
        sightings[rows, columns] = counted
        self.settled = not ((counted > 0) & (counted < _STATIC_SIGHTINGS)).any()
        self._seen_since_sweep[part] |= seen


class _Seen(NamedTuple):
    """The cells of a part of a picture."""

    image: Picture
    rect: Rect
    yuv: Image  # (h, w, 3)


def _foreground_of(blob: Blob, seen: _Seen, static: Image, noise: Noise) -> list[Blob]:
    """What of a blob is not static; static (h, w): cells of what is seen."""
    part = slices(_from(seen.rect, blob.rect))
    known = with_uncovered(static[part], blob.mask, seen.yuv[part], noise, _MIN_CELLS)
    foreground: Image = ((blob.mask > 0) & ~known).view(np.uint8)
    cells = cv2.countNonZero(foreground)
    if cells >= (1.0 - _RIM_SHARE) * blob.cells:
        return [blob]
    if cells < _MIN_CELLS:
        return []
    eroded = cv2.erode(foreground, _SQUARE, anchor=(0, 0), borderValue=0)
    foreground = cv2.dilate(eroded, _SQUARE, anchor=(1, 1))
    return blobs_of_contours(
        external_contours(foreground), foreground, blob.color, blob.rect[:2], _MIN_CELLS
    )


def _bounds(rects: Sequence[Rect]) -> Rect:
    """The rectangle about several."""
    left, top, right, bottom = zip(*rects, strict=True)
    return min(left), min(top), max(right), max(bottom)


def _from(origin: Rect, rect: Rect) -> Rect:
    """A rectangle as seen from the top left corner of another."""
    x, y = origin[:2]
    return rect[0] - x, rect[1] - y, rect[2] - x, rect[3] - y


def _is_inside(rect: Rect, other: Rect) -> bool:
    (x0, y0, x1, y1), (left, top, right, bottom) = rect, other
    return left <= x0 and top <= y0 and x1 <= right and y1 <= bottom


def _with_rims(blobs: Sequence[Blob], region: Rect) -> Image:
    """Where blobs are in a region (h, w), bool, and the cells about them.

    At the edge of a colour noise decides which cells have it, anew in each frame.
    """
    left, top, right, bottom = region
    covered = np.zeros((bottom - top, right - left), np.uint8)
    for blob in blobs:
        x0, y0, x1, y1 = blob.rect
        covered[y0 - top : y1 - top, x0 - left : x1 - left] |= blob.mask
    return cv2.dilate(covered, _RIM) > 0


def _exclude(seen: Image, region: Rect, rect: Rect) -> None:
    """Clear the cells of a rectangle in a mask (h, w) of a region."""
    left, top = region[:2]
    x1, y1 = rect[2] - left, rect[3] - top
    if x1 > 0 and y1 > 0:
        seen[max(rect[1] - top, 0) : y1, max(rect[0] - left, 0) : x1] = False
