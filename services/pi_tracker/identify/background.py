"""What stands in the room in a marker's colour, cell by cell: taken away from blobs, so that a
marker before it or beside it is seen.

Pure. Only what was not taken for a marker is learnt, where it stood still for a few sightings; what
looks otherwise than it is something else, such as a marker that passes before it. Nothing is known
at the start; a thing that is taken away is forgotten; where the light changes, or the camera is
pushed, everything is learnt anew. A picture of another size is another room.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from services.pi_tracker.detect.blob_search import Blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import Picture, Rect

# Sightings in a row before a cell counts as standing: a tenth of a second at 30 fps, too long for a
# moving finger; and how many are remembered, so that a thing is known at once when the hand before
# it goes.
_SIGHTINGS, _MOST = 4, 16
# What looks otherwise counts against it twice.
_AGAINST = 2
# A cell looks as it did when luma, U and V are this many of their standard deviations from the
# mean, and a little for shadows; five, because of the thousand cells of a thing not one should
# stand out.
_ALIKE, _SHADOW = 5.0, 3.0
# Share of what is new in what is remembered.
_NEW = 0.2
# A blob of which less than this share stands in the room is a marker whose rim touches it: left as
# it is.
_RIM = 0.1
# Cells around a marker in which nothing is learnt: its own rim, in the colours of blur and of light
# from the side.
_CLEAR = 4
# What is left of a blob, in cells, to be looked at: shadows and the shimmer of edges leave less.
_LEAST_CELLS = 6
# A thing not seen for one to two such times has gone, or is hidden for good.
_FORGET_NS = 30_000_000_000
_SQUARE = np.ones((2, 2), np.uint8)


class Room:
    """Standing things of one camera."""

    def __init__(self) -> None:
        self._size = (0, 0)
        self._look = np.empty((0, 0, 3), np.float32)
        self._sightings = np.empty((0, 0), np.int16)
        self._fresh = np.empty((0, 0), bool)
        self._now = np.empty((0, 0), bool)
        self._swept_ns = 0
        self._empty = True
        # Whether nothing waits for more sightings.
        self.settled = True

    def without(self, image: Picture, blobs: Sequence[Blob], noise: Noise) -> list[Blob]:
        """What of the blobs does not stand in the room.

        Those that have nothing to do with it are the same objects.
        """
        if self._empty or image.size != self._size:
            return list(blobs)
        return [part for blob in blobs for part in self._moved(image, blob, noise)]

    def learn(
        self,
        image: Picture,
        region: Rect,
        blobs: Sequence[Blob],
        markers: Sequence[Rect],
        noise: Noise,
        stamp_ns: int,
    ) -> None:
        """Take in all blobs found in a region, as they were found, but for where markers are."""
        if image.size != self._size:
            self._begin(image.size, stamp_ns)
        if not 0 <= stamp_ns - self._swept_ns < _FORGET_NS:
            self._sightings[~self._fresh] = 0
            self._fresh[:] = False
            self._swept_ns = stamp_ns
        for blob in blobs:
            inside = blob.mask > 0
            for marker in markers:
                _clear(inside, blob.rect, marker)
            if inside.any():
                self._sight(image, blob.rect, inside, noise)
                self._empty = self.settled = False
        if not self.settled:
            self._interrupt(region)

    def _interrupt(self, region: Rect) -> None:
        """What was not seen this time, and not often enough before, begins anew."""
        part = (slice(region[1], region[3]), slice(region[0], region[2]))
        sightings, now = self._sightings[part], self._now[part]
        waiting = sightings < _SIGHTINGS
        sightings[waiting & ~now] = 0
        self.settled = not (waiting & now).any()
        now[:] = False

    def _begin(self, size: tuple[int, int], stamp_ns: int) -> None:
        width, height = size
        self._size, self._swept_ns, self._empty = size, stamp_ns, True
        self._look = np.zeros((height, width, 3), np.float32)
        self._sightings = np.zeros((height, width), np.int16)
        self._fresh = np.zeros((height, width), bool)
        self._now = np.zeros((height, width), bool)

    def _sight(self, image: Picture, rect: Rect, inside: Image, noise: Noise) -> None:
        part = (slice(rect[1], rect[3]), slice(rect[0], rect[2]))
        look, seen = self._look[part], _look(image, rect)
        sightings = self._sightings[part]
        alike = (sightings > 0) & _alike(seen, look, noise)
        counted = np.where(alike, np.minimum(sightings + 1, _MOST), sightings - _AGAINST)
        new = inside & (counted <= 0)
        kept = inside & alike
        look[kept] += _NEW * (seen[kept] - look[kept])
        look[new] = seen[new]
        np.copyto(sightings, np.maximum(counted, 1), where=inside)
        self._fresh[part] |= inside
        self._now[part] |= inside

    def _moved(self, image: Picture, blob: Blob, noise: Noise) -> list[Blob]:
        x0, y0, x1, y1 = blob.rect
        part = (slice(y0, y1), slice(x0, x1))
        standing = self._sightings[part] >= _SIGHTINGS
        if not standing.any():
            return [blob]
        standing &= _alike(_look(image, blob.rect), self._look[part], noise)
        left: Image = ((blob.mask > 0) & ~standing).view(np.uint8)
        cells = cv2.countNonZero(left)
        if cells >= (1.0 - _RIM) * blob.cells:
            return [blob]
        if cells < _LEAST_CELLS:
            return []
        left = cv2.dilate(
            cv2.erode(left, _SQUARE, anchor=(0, 0), borderValue=0), _SQUARE, anchor=(1, 1)
        )
        contours, _ = cv2.findContours(left, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        found = []
        for x, y, w, h in map(cv2.boundingRect, contours):
            mask = left[y : y + h, x : x + w]
            cells = cv2.countNonZero(mask)
            if cells >= _LEAST_CELLS:
                rect = (x0 + x, y0 + y, x0 + x + w, y0 + y + h)
                found.append(
                    Blob(
                        blob.color,
                        rect,
                        mask,
                        cells,
                        4.0 * cells,
                        2.0 * x0 + 2 * x + w - 0.5,
                        2.0 * y0 + 2 * y + h - 0.5,
                    )
                )
        return found


def _look(image: Picture, rect: Rect) -> Image:
    """Y, U, V of cells, float32 (h, w, 3)."""
    luma, chroma = image.cells(rect)
    return np.dstack((luma, chroma)).astype(np.float32)


def _alike(seen: Image, look: Image, noise: Noise) -> Image:
    """Which cells look as they did; (h, w)."""
    off = np.abs(seen - look)
    chroma = _ALIKE * noise.chroma + _SHADOW
    return (
        (off[..., 0] <= _ALIKE * noise.luma + _SHADOW)
        & (off[..., 1] <= chroma)
        & (off[..., 2] <= chroma)
    )


def _clear(inside: Image, rect: Rect, marker: Rect) -> None:
    """Leave out where a marker is, and around it."""
    x0, y0 = max(marker[0] - _CLEAR - rect[0], 0), max(marker[1] - _CLEAR - rect[1], 0)
    x1, y1 = marker[2] + _CLEAR - rect[0], marker[3] + _CLEAR - rect[1]
    if x1 > 0 and y1 > 0:
        inside[y0:y1, x0:x1] = False
