"""A blob: a connected patch of cells of one colour; and blobs from contours of a mask. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2

from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.planes import Rect


class Blob(NamedTuple):
    """A connected patch of one colour."""

    color: int  # class index from 0
    rect: Rect  # bounding rectangle of the cells
    mask: Image  # (h, w) of the rectangle, not 0 where the blob is
    cells: int  # how many cells have the colour
    # Area in pixels, and the middle of the rectangle: near enough to tell blobs apart.
    area_px: float
    x_px: float
    y_px: float


def make_blob(color: int, rect: Rect, mask: Image, cells: int) -> Blob:
    """A blob with its area and middle."""
    x0, y0, x1, y1 = rect
    return Blob(color, rect, mask, cells, 4.0 * cells, x0 + x1 - 0.5, y0 + y1 - 0.5)


def external_contours(mask: Image) -> Sequence[Image]:
    """Outer contours of a mask (h, w)."""
    return cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]


def blobs_of_contours(
    contours: Sequence[Image], mask: Image, color: int, origin: tuple[int, int], min_cells: int
) -> list[Blob]:
    """Blobs of at least min_cells; origin is the mask's top left cell in the image."""
    left, top = origin
    found: list[Blob] = []
    for x, y, w, h in map(cv2.boundingRect, contours):
        part = mask[y : y + h, x : x + w]
        cells = cv2.countNonZero(part)
        if cells >= min_cells:
            rect = (left + x, top + y, left + x + w, top + y + h)
            found.append(make_blob(color, rect, part, cells))
    return found
