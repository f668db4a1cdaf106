"""Blobs of all colours in a rectangle: one lookup, one pass of mask filters, one contour search.

Pure. A rectangle without any colour gives no blobs; one so cluttered that a room of the right hue fills it gives the largest few
per colour.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rhot.config import Tracker
from services.pi_tracker.colors import ColorTable
from services.pi_tracker.frame import Image
from services.pi_tracker.planes import Picture, Rect

# Contours looked at in one rectangle, largest first. Six markers, their reflections and a dozen distractors stay far below;
# a wall of noise must not cost more than a frame (1.5 us each).
_MAX_CONTOURS = 64
# What is left of a marker among others after a cell of its width is taken away, at least; of a seam next to nothing is.
_SEAM_CELLS, _SEAM_SHARE = 3, 0.25


@dataclass(frozen=True, eq=False)
class Blob:
    """A connected patch of one colour: class index from 0, its cells' bounding rectangle, their mask (0/1) and how many they are."""

    color: int
    rect: Rect
    mask: Image  # (h, w) of the rectangle
    cells: int

    @property
    def area_px(self) -> float:
        return 4.0 * self.cells

    @property
    def centre_px(self) -> tuple[float, float]:
        """Middle of the rectangle in pixels: near enough to tell blobs apart."""
        x0, y0, x1, y1 = self.rect
        return float(x0 + x1) - 0.5, float(y0 + y1) - 0.5


class Searcher:
    """Finds blobs with one colour table and the mask filters of rig.toml."""

    def __init__(self, table: ColorTable, settings: Tracker) -> None:
        self._table = table
        self.names = table.names
        # Settings are in pixels of the full image, masks in cells of two; 3 cells is the smallest kernel.
        self._gaussian = max(3, settings.gaussian_px // 2 | 1) if settings.gaussian_px > 1 else 0
        # A round of 3x3 px takes away 2 px of width, which is one cell: a 2x2 element.
        self._element = np.ones((2, 2), np.uint8)
        self._erode, self._dilate = settings.erode, settings.dilate
        self._min_cells = max(1, round(settings.min_area_px / 4.0))

    def blobs(self, picture: Picture, rect: Rect) -> list[Blob]:
        """All blobs of at least min_area_px, largest first."""
        luma, chroma = picture.cells(rect)
        labels = self._table.classify(luma, chroma)
        mask = self._filtered(labels)
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        if len(contours) > _MAX_CONTOURS:
            contours = sorted(contours, key=len, reverse=True)[:_MAX_CONTOURS]
        found: list[Blob] = []
        for contour in contours:
            x, y, w, h = cv2.boundingRect(contour)
            if w * h >= self._min_cells:
                inside = np.zeros((h, w), np.uint8)
                cv2.drawContours(inside, [contour], 0, 1, cv2.FILLED, offset=(-x, -y))
                found += self._of_contour(labels[y : y + h, x : x + w], inside, (rect[0] + x, rect[1] + y))
        found.sort(key=lambda blob: -blob.cells)
        return found

    def _filtered(self, labels: Image) -> Image:
        """255 where a colour is, after Gaussian, erosion and dilation."""
        mask = cv2.threshold(labels, 0, 255, cv2.THRESH_BINARY)[1]
        if self._gaussian:
            mask = cv2.threshold(cv2.GaussianBlur(mask, (self._gaussian, self._gaussian), 0), 127, 255, cv2.THRESH_BINARY)[1]
        # An even element reaches to one side; the opposite anchors of erosion and dilation bring the blob back to its place.
        if self._erode:
            mask = cv2.erode(mask, self._element, anchor=(0, 0), iterations=self._erode)
        if self._dilate:
            mask = cv2.dilate(mask, self._element, anchor=(1, 1), iterations=self._dilate)
        return mask

    def _of_contour(self, labels: Image, inside: Image, origin: tuple[int, int]) -> list[Blob]:
        """The blobs inside one contour: one as a rule, several where markers touch."""
        counts = np.bincount((labels * inside).ravel(), minlength=len(self.names) + 1).tolist()
        classes = [k for k, count in enumerate(counts) if k and count >= self._min_cells]
        if len(classes) == 1:
            # Holes of noise inside the blob count as its own.
            return self._blob(classes[0], inside, origin)
        return [blob for k in classes for blob in self._of_class((labels == k).view(np.uint8) & inside, k, origin)]

    def _of_class(self, mask: Image, k: int, origin: tuple[int, int]) -> list[Blob]:
        # Where two paints meet, a seam a cell or two wide has the mixed colour, which may be a third paint's: green beside blue is cyan.
        if cv2.countNonZero(cv2.erode(mask, self._element, anchor=(0, 0))) < max(_SEAM_CELLS, _SEAM_SHARE * cv2.countNonZero(mask)):
            return []
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        found: list[Blob] = []
        for x, y, w, h in map(cv2.boundingRect, contours):
            found += self._blob(k, mask[y : y + h, x : x + w], (origin[0] + x, origin[1] + y))
        return found

    def _blob(self, k: int, mask: Image, origin: tuple[int, int]) -> list[Blob]:
        cells = cv2.countNonZero(mask)
        if cells < self._min_cells:
            return []
        h, w = mask.shape
        return [Blob(k - 1, (origin[0], origin[1], origin[0] + w, origin[1] + h), mask, cells)]
