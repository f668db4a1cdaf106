"""Blob detection for all colours at once: one table lookup, one opening, one contour search.

Pure. A rectangle without any colour gives no blobs. One that a room of the right hue fills gives
the largest few per colour.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from rhot.files.rig_tables import Tracker
from services.pi_tracker.compiled.library import loaded
from services.pi_tracker.detect.color_table import ColorTable
from services.pi_tracker.detect.compiled_patches import CompiledPatches, Patches
from services.pi_tracker.image.blob import Blob, blobs_of_contours, external_contours, make_blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.morphology import opening
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture

# Contours examined in one rectangle, largest first. Six markers, their reflections and a dozen
# distractors stay far below; a room full of colour must not cost more than a frame: 28 ms at most,
# where unlimited it was 24 s.
_MAX_CONTOURS = 64
# A coarse search of every other row of a picture of 76800 cells costs 32 us, classifying all of it
# 56 us, a tenth of it 16 us: worth it where there are many cells, and colour was not all over the
# picture the last time.
_COARSE_MIN_CELLS, _SPARSE_SHARE = 20000, 0.4
# What is left of a marker among others after a cell of its width is taken away, at least; of a seam
# next to nothing is.
_SEAM_CELLS, _SEAM_SHARE = 3, 0.25
_NEIGHBOURS = np.ones((3, 3), np.uint8)


class BlobDetector:
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
        self._row_step = 1 if self._gaussian else 1 + self._erode
        self._sparse = True
        # Filters work where there is any colour, and around it as far as they reach. At least one
        # empty cell is needed between a row's right end and the next row's left end: `opening`
        # sees them side by side.
        self._margin = 1 + self._gaussian + max(self._dilate - self._erode, 0)
        self._min_cells = max(1, round(settings.min_area_px / 4.0))
        self._compiled: CompiledPatches | None = None
        if loaded is not None and not self._gaussian and self._erode == self._dilate:
            self._compiled = CompiledPatches(
                loaded,
                table.layers,
                margin=self._margin,
                rounds=self._erode,
                min_cells=self._min_cells,
                most=_MAX_CONTOURS,
            )

    def detect(self, picture: Picture, rect: Rect, keep_thin: bool = False) -> list[Blob]:
        """All blobs of at least min_area_px in a rectangle, in no order.

        Thin ones beside another colour only if asked for: they may be its edge.
        """
        whole_cells = (rect[2] - rect[0]) * (rect[3] - rect[1])
        large = whole_cells >= _COARSE_MIN_CELLS
        if large and self._row_step > 1 and self._sparse:
            rect = self._coarse_search(picture, rect)
        planes = picture.planes
        found = None if self._compiled is None or planes is None else self._compiled(planes, rect)
        if found is None:
            found = self._detect_in_python(picture, rect, keep_thin)
        if large:
            self._sparse = found.cells <= _SPARSE_SHARE * whole_cells
        return found.blobs

    def _detect_in_python(self, picture: Picture, rect: Rect, keep_thin: bool) -> Patches:
        """The blobs of a rectangle, whatever it holds."""
        patch = self._table.classify_cropped(*picture.cells(rect), self._margin)
        if not patch.mask.size:
            return Patches(0, [])
        mask = self._filtered(patch.mask)
        contours = _largest(cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0])
        left, top = rect[0] + patch.left, rect[1] + patch.top
        found: list[Blob] = []
        for contour in contours:
            x, y, w, h = cv2.boundingRect(contour)
            if w * h < self._min_cells:
                continue
            classes = patch.classes[y : y + h, x : x + w]
            # Counting in bytes is five times faster than numpy's bincount on as few.
            class_bytes = classes.tobytes()
            k = class_bytes[h // 2 * w + w // 2] or max(class_bytes)
            cells = class_bytes.count(k)
            if class_bytes.count(0) + cells < w * h:
                own = _filled(contour, (x, y), classes.shape)
                found += self._split_by_color(own, classes, (left + x, top + y), keep_thin)
            elif k and cells >= self._min_cells:
                # One colour only, as a rule.
                blob_rect = (left + x, top + y, left + x + w, top + y + h)
                found.append(make_blob(k - 1, blob_rect, mask[y : y + h, x : x + w], cells))
        return Patches(patch.mask.size, found)

    def _coarse_search(self, picture: Picture, rect: Rect) -> Rect:
        """The part of a rectangle in which there may be blobs, from every so many rows."""
        x0, y0, x1, y1 = rect
        candidates = self._table.candidates(*picture.cells(rect, self._row_step))
        x, y, w, h = cv2.boundingRect(candidates)
        if not w:
            return (x0, y0, x0 + 1, y0 + 1)
        top = y0 + max((y - 1) * self._row_step + 1, 0)
        bottom = min(y0 + (y + h) * self._row_step, y1)
        # The empty column to the right keeps a row's ends apart, as the margin does.
        return (x0 + x, top, min(x0 + x + w + 1, x1), bottom)

    def _filtered(self, mask: Image) -> Image:
        """The mask after Gaussian, erosion and dilation."""
        if self._gaussian:
            mask = cv2.GaussianBlur(mask, (self._gaussian, self._gaussian), 0)
            mask = cv2.threshold(mask, 127, 255, cv2.THRESH_BINARY)[1]
        return opening(mask, self._erode, self._dilate)

    def _split_by_color(
        self, inside: Image, classes: Image, origin: tuple[int, int], keep_thin: bool
    ) -> list[Blob]:
        """The blobs of a contour whose rectangle holds several colours, as where markers touch.

        inside (h, w) is 1 within the contour.
        """
        counts = np.bincount((classes * inside).ravel(), minlength=2).tolist()
        present = [k for k, count in enumerate(counts) if k and count >= self._min_cells]
        if len(present) == 1:
            # A few cells of other colours are noise.
            (k,) = present
            (left, top), (h, w) = origin, classes.shape
            return [make_blob(k - 1, (left, top, left + w, top + h), inside, counts[k])]
        masks = {k: (classes == k).view(np.uint8) & inside for k in present}
        found: list[Blob] = []
        for k, mask in masks.items():
            if not _is_seam(masks, k, keep_thin):
                contours = _largest(external_contours(mask))
                found += blobs_of_contours(contours, mask, k - 1, origin, self._min_cells)
        return found


def _filled(contour: Image, at: tuple[int, int], shape: tuple[int, ...]) -> Image:
    """1 within a contour, 0 elsewhere; (h, w) of a shape whose top left is `at`."""
    inside = np.zeros(shape, np.uint8)
    return cv2.drawContours(inside, [contour], 0, 1, cv2.FILLED, offset=(-at[0], -at[1]))


def _largest(contours: Sequence[Image]) -> Sequence[Image]:
    """At most _MAX_CONTOURS of them."""
    if len(contours) <= _MAX_CONTOURS:
        return contours
    return sorted(contours, key=cv2.contourArea, reverse=True)[:_MAX_CONTOURS]


def _is_seam(masks: dict[int, Image], k: int, keep_thin: bool) -> bool:
    """Whether a class among others is but the seam of two.

    Where paints meet, a cell or two have the mixed colour, which may be a third paint's: green
    beside blue is cyan. With keep_thin, what lies beside a single one is none.
    """
    mask = masks[k]
    eroded_cells = cv2.countNonZero(opening(mask, 1, 0))
    if eroded_cells >= max(_SEAM_CELLS, _SEAM_SHARE * cv2.countNonZero(mask)):
        return False
    if not keep_thin:
        return True
    around = cv2.dilate(mask, _NEIGHBOURS)
    neighbours = sum(
        cv2.countNonZero(around & other) >= _SEAM_CELLS
        for number, other in masks.items()
        if number != k
    )
    return neighbours > 1
