"""Blobs of all colours in a rectangle: one lookup, one pass of mask filters, one contour search.

Pure. A rectangle without any colour gives no blobs; one so cluttered that a room of the right hue
fills it gives the largest few per colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from rhot.files.config import Tracker
from services.pi_tracker.detect.color_table import ColorTable
from services.pi_tracker.detect.morphology import opened
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.yuv_planes import Picture, Rect

# Contours looked at in one rectangle, largest first. Six markers, their reflections and a dozen
# distractors stay far below; a room full of colour must not cost more than a frame: 28 ms at most,
# where unlimited it was 24 s.
_MAX_CONTOURS = 64
# A look at every other row of a picture of 76800 cells costs 32 us, classifying all of it 56 us, a
# tenth of it 16 us: worth it where there are many cells, and colour was not all over the place the
# last time.
_LARGE_CELLS, _SPARSE = 20000, 0.4
# What is left of a marker among others after a cell of its width is taken away, at least; of a seam
# next to nothing is.
_SEAM_CELLS, _SEAM_SHARE = 3, 0.25
_NEIGHBOURS = np.ones((3, 3), np.uint8)


class Blob(NamedTuple):
    """A connected patch of one colour: class index from 0, its cells' bounding rectangle, their
    mask and how many have the colour.
    """

    color: int
    rect: Rect
    mask: Image  # (h, w) of the rectangle, not 0 where the blob is
    cells: int
    # Area in pixels, and the middle of the rectangle: near enough to tell blobs apart.
    area_px: float
    x_px: float
    y_px: float


class Searcher:
    """Finds blobs with one colour table and the mask filters of rig.toml."""

    def __init__(self, table: ColorTable, settings: Tracker) -> None:
        self._table = table
        self.names = table.names
        # Settings are in pixels of the full image, masks in cells, which are means of 2x2 pixels
        # already: a kernel of 3 px adds nothing.
        self._gaussian = settings.gaussian_px // 2 | 1 if settings.gaussian_px > 3 else 0
        # A round of 3x3 px takes away 2 px of width, which is one cell.
        self._erode, self._dilate = settings.erode, settings.dilate
        # Every cell that survives erosion and dilation lies in a square of so many cells a side
        # that all have a colour: every so many rows are enough to see whether and where there is
        # any.
        self._step = 1 if self._gaussian else 1 + self._erode
        self._sparse = True
        # Filters work where there is any colour, and around it as far as they reach; at the least
        # there is a cell between what stands at the right side and what stands at the left, a row
        # below: `opened` sees them side by side.
        self._margin = 1 + self._gaussian + max(self._dilate - self._erode, 0)
        self._min_cells = max(1, round(settings.min_area_px / 4.0))

    def blobs(self, picture: Picture, rect: Rect, thin: bool = False) -> list[Blob]:
        """All blobs of at least min_area_px, in no order.

        Thin ones beside another colour only if asked for: they may be its edge.
        """
        whole = (rect[2] - rect[0]) * (rect[3] - rect[1])
        large = whole >= _LARGE_CELLS
        if large and self._step > 1 and self._sparse:
            rect = self._narrowed(picture, rect)
        x0, y0, labels, mask = self._table.patch(*picture.cells(rect), self._margin)
        if large:
            self._sparse = mask.size <= _SPARSE * whole
        if not mask.size:
            return []
        mask = self._filtered(mask)
        contours = _largest(cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0])
        found: list[Blob] = []
        left, top = rect[0] + x0, rect[1] + y0
        for contour in contours:
            x, y, w, h = cv2.boundingRect(contour)
            if w * h < self._min_cells:
                continue
            inside = labels[y : y + h, x : x + w]
            # Counting in bytes is five times faster than numpy's bincount on as few.
            inner = inside.tobytes()
            k = inner[h // 2 * w + w // 2] or max(inner)
            mine = inner.count(k)
            if inner.count(0) + mine < w * h:
                found += self._parted(contour, inside, (x, y), (left + x, top + y), thin)
            elif k and mine >= self._min_cells:
                # One colour only, as a rule.
                found.append(_blob(k, mask[y : y + h, x : x + w], mine, left + x, top + y, w, h))
        return found

    def _narrowed(self, picture: Picture, rect: Rect) -> Rect:
        """The part of a rectangle in which there may be blobs."""
        x0, y0, x1, y1 = rect
        x, y, w, h = cv2.boundingRect(self._table.likely(*picture.cells(rect, self._step)))
        top, bottom = y0 + max((y - 1) * self._step + 1, 0), min(y0 + (y + h) * self._step, y1)
        # The column to the right keeps what stands there and what stands at the left apart, as the
        # margin does.
        return (x0 + x, top, min(x0 + x + w + 1, x1), bottom) if w else (x0, y0, x0 + 1, y0 + 1)

    def _filtered(self, mask: Image) -> Image:
        """The mask after Gaussian, erosion and dilation."""
        if self._gaussian:
            mask = cv2.GaussianBlur(mask, (self._gaussian, self._gaussian), 0)
            mask = cv2.threshold(mask, 127, 255, cv2.THRESH_BINARY)[1]
        return opened(mask, self._erode, self._dilate)

    def _parted(
        self,
        contour: Image,
        labels: Image,
        at: tuple[int, int],
        origin: tuple[int, int],
        thin: bool,
    ) -> list[Blob]:
        """The blobs of a contour whose rectangle holds several colours, as where markers touch."""
        inside = np.zeros(labels.shape, np.uint8)
        cv2.drawContours(inside, [contour], 0, 1, cv2.FILLED, offset=(-at[0], -at[1]))
        counts = np.bincount((labels * inside).ravel(), minlength=2).tolist()
        classes = [k for k, count in enumerate(counts) if k and count >= self._min_cells]
        if len(classes) == 1:
            # A few cells of other colours are noise.
            return [
                _blob(
                    classes[0],
                    inside,
                    counts[classes[0]],
                    *origin,
                    labels.shape[1],
                    labels.shape[0],
                )
            ]
        masks = {k: (labels == k).view(np.uint8) & inside for k in classes}
        return [
            blob
            for k in classes
            if not _is_seam(masks, k, thin)
            for blob in self._of_class(masks[k], k, origin)
        ]

    def _of_class(self, mask: Image, k: int, origin: tuple[int, int]) -> list[Blob]:
        contours = _largest(cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0])
        found: list[Blob] = []
        for x, y, w, h in map(cv2.boundingRect, contours):
            part = mask[y : y + h, x : x + w]
            cells = cv2.countNonZero(part)
            if cells >= self._min_cells:
                found.append(_blob(k, part, cells, origin[0] + x, origin[1] + y, w, h))
        return found


def _largest(contours: Sequence[Image]) -> Sequence[Image]:
    """As many as are worth a look."""
    return (
        contours
        if len(contours) <= _MAX_CONTOURS
        else sorted(contours, key=cv2.contourArea, reverse=True)[:_MAX_CONTOURS]
    )


def _is_seam(masks: dict[int, Image], k: int, thin: bool) -> bool:
    """Whether a class among others is but the seam of two: where paints meet, a cell or two have
    the mixed colour, which may be a third paint's: green beside blue is cyan. With thin, what lies
    beside a single one is none.
    """
    mask = masks[k]
    if cv2.countNonZero(opened(mask, 1, 0)) >= max(
        _SEAM_CELLS, _SEAM_SHARE * cv2.countNonZero(mask)
    ):
        return False
    around = cv2.dilate(mask, _NEIGHBOURS)
    return (
        not thin
        or sum(
            cv2.countNonZero(around & other) >= _SEAM_CELLS
            for number, other in masks.items()
            if number != k
        )
        > 1
    )


def _blob(k: int, mask: Image, cells: int, x: int, y: int, w: int, h: int) -> Blob:
    return Blob(
        k - 1, (x, y, x + w, y + h), mask, cells, 4.0 * cells, x + x + w - 0.5, y + y + h - 0.5
    )
