"""Background subtraction: removes static background in a marker's colour from blobs, cell by cell.

So a marker is seen that is in front of such an object or beside it. Pure. Only blobs that were not
taken for a marker are learnt, where they stay the same for a few sightings. A cell that differs
from its mean is foreground, such as a marker that passes. Nothing is known at the start. An object
that is removed is forgotten. Where the light changes, or the camera is moved, everything is learnt
again. A picture of another size starts a new model.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

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
_GATE_SIGMAS, _SHADOW = 5.0, 3.0
# Weight of a new sighting in the mean.
_NEW_WEIGHT = 0.2
# A blob of which less than this share is background is a marker whose rim touches it: left as it
# is.
_RIM_SHARE = 0.1
# Cells around a marker in which nothing is learnt: its own rim, in the colours of blur and of light
# from the side.
_MARKER_MARGIN = 4
# What is left of a blob, in cells, to be examined: shadows and the shimmer of edges leave less.
_MIN_CELLS = 6
# An object not seen for one to two such times is gone, or hidden for good.
_FORGET_NS = 30_000_000_000
_SQUARE = np.ones((2, 2), np.uint8)


class BackgroundModel:
    """The static background of one camera, as far as it has a marker's colour."""

    def __init__(self) -> None:
        self._size = (0, 0)
        self._mean = np.empty((0, 0, 3), np.float32)  # (h, w, 3) Y, U, V
        self._sightings = np.empty((0, 0), np.int16)  # (h, w) 0 where nothing is known
        self._seen_since_sweep = np.empty((0, 0), bool)
        self._seen_now = np.empty((0, 0), bool)
        self._swept_ns = 0
        self._empty = True
        # Whether no cell waits for more sightings.
        self.settled = True

    def foreground(self, image: Picture, blobs: Sequence[Blob], noise: Noise) -> list[Blob]:
        """What of the blobs is not static background.

        Those without any background in them are the same objects.
        """
        if self._empty or image.size != self._size:
            return list(blobs)
        return [part for blob in blobs for part in self._foreground_of(image, blob, noise)]

    def update(
        self,
        image: Picture,
        region: Rect,
        blobs: Sequence[Blob],
        markers: Sequence[Rect],
        noise: Noise,
        stamp_ns: int,
    ) -> None:
        """Take in all blobs detected in a region, except where markers are."""
        if image.size != self._size:
            self._reset(image.size, stamp_ns)
        if not 0 <= stamp_ns - self._swept_ns < _FORGET_NS:
            self._sightings[~self._seen_since_sweep] = 0
            self._seen_since_sweep[:] = False
            self._swept_ns = stamp_ns
        for blob in blobs:
            inside = blob.mask > 0
            for marker in markers:
                _exclude_marker(inside, blob.rect, marker)
            if inside.any():
                self._learn(image, blob.rect, inside, noise)
                self._empty = self.settled = False
        if not self.settled:
            self._drop_interrupted(region)

    def _drop_interrupted(self, region: Rect) -> None:
        """Reset cells that are not static yet and were not seen this time."""
        part = _slices(region)
        sightings, seen_now = self._sightings[part], self._seen_now[part]
        waiting = sightings < _STATIC_SIGHTINGS
        sightings[waiting & ~seen_now] = 0
        self.settled = not (waiting & seen_now).any()
        seen_now[:] = False

    def _reset(self, size: tuple[int, int], stamp_ns: int) -> None:
        width, height = size
        self._size, self._swept_ns, self._empty = size, stamp_ns, True
        self._mean = np.zeros((height, width, 3), np.float32)
        self._sightings = np.zeros((height, width), np.int16)
        self._seen_since_sweep = np.zeros((height, width), bool)
        self._seen_now = np.zeros((height, width), bool)

    def _learn(self, image: Picture, rect: Rect, inside: Image, noise: Noise) -> None:
        """Count a sighting of the cells `inside` (h, w) of a rectangle, and move their mean."""
        part = _slices(rect)
        mean, seen = self._mean[part], _yuv(image, rect)
        sightings = self._sightings[part]
        agrees = (sightings > 0) & _agrees(seen, mean, noise)
        counted = np.where(
            agrees, np.minimum(sightings + 1, _MAX_SIGHTINGS), sightings - _MISMATCH_COST
        )
        replaced = inside & (counted <= 0)
        confirmed = inside & agrees
        mean[confirmed] += _NEW_WEIGHT * (seen[confirmed] - mean[confirmed])
        mean[replaced] = seen[replaced]
        np.copyto(sightings, np.maximum(counted, 1), where=inside)
        self._seen_since_sweep[part] |= inside
        self._seen_now[part] |= inside

    def _foreground_of(self, image: Picture, blob: Blob, noise: Noise) -> list[Blob]:
        part = _slices(blob.rect)
        static = self._sightings[part] >= _STATIC_SIGHTINGS
        if not static.any():
            return [blob]
        static &= _agrees(_yuv(image, blob.rect), self._mean[part], noise)
        foreground: Image = ((blob.mask > 0) & ~static).view(np.uint8)
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


def _slices(rect: Rect) -> tuple[slice, slice]:
    """Rows and columns of a rectangle."""
    x0, y0, x1, y1 = rect
    return slice(y0, y1), slice(x0, x1)


def _yuv(image: Picture, rect: Rect) -> Image:
    """Y, U, V of cells, float32 (h, w, 3)."""
    luma, chroma = image.cells(rect)
    return np.dstack((luma, chroma)).astype(np.float32)


def _agrees(seen: Image, mean: Image, noise: Noise) -> Image:
    """Which cells (h, w) are within the gate about their mean."""
    difference = np.abs(seen - mean)
    luma_gate = _GATE_SIGMAS * noise.luma + _SHADOW
    chroma_gate = _GATE_SIGMAS * noise.chroma + _SHADOW
    return (
        (difference[..., 0] <= luma_gate)
        & (difference[..., 1] <= chroma_gate)
        & (difference[..., 2] <= chroma_gate)
    )


def _exclude_marker(inside: Image, rect: Rect, marker: Rect) -> None:
    """Clear the cells of a marker and around it in a mask `inside` (h, w) of a rectangle."""
    x0 = max(marker[0] - _MARKER_MARGIN - rect[0], 0)
    y0 = max(marker[1] - _MARKER_MARGIN - rect[1], 0)
    x1 = marker[2] + _MARKER_MARGIN - rect[0]
    y1 = marker[3] + _MARKER_MARGIN - rect[1]
    if x1 > 0 and y1 > 0:
        inside[y0:y1, x0:x1] = False
