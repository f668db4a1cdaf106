"""Dots that are blurred into the skin, or too dim for their colour's range, where dots are missing.

What moves by its own width while a picture is exposed is paint and skin at once: no range of
colours that leaves skin out holds it. Its chroma tells. Light and shade move the chroma of skin
along the line from grey to skin; paint moves it off that line, by as much as there is of it:

    chroma - grey = share (paint - grey) + rest (skin - grey),

two equations for two shares. Other things are told from a dot by a rest that no mixture has. Pure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from services.pi_tracker.detect import search_region
from services.pi_tracker.dots.dot import Patch
from services.pi_tracker.identify.blob_shape import touch
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture

Array = npt.NDArray[np.float64]
Point = tuple[float, float]

_GREY = 128.0
# Paint whose hue is nearer to the skin's, or to its opposite, than this sine says nothing.
_LEAST_SINE = 0.3
# A cell is a faint dot's from this share of paint on, and from so many sigmas of noise; and no rest
# is larger or smaller: skin in the brightest light has 1.5. (Tuning half of
# benchmarks/dots_pictures.py, 15 dots: with .14, and half as small ones, a fist had false ones in
# two of three pictures, and none so. Without a bound of the rest, red things behind dark hands were
# dots in a quarter to half of their pictures.)
_SHARE, _SIGMAS, _RESTS = 0.18, 4.0, (-0.4, 1.8)
# All paint of a faint dot is so much of one that shows as a whole, and no further than so many
# diameters, and what dots lately moved by, from where one is missing; a missing one has no blob
# within this part of a diameter.
_AREAS, _REACH, _OWN = (0.25, 2.0), 2.0, 0.7
# A centre is known to this share of a diameter, and is worth so much.
_SIGMA, _QUALITY = 0.15, 0.5
# Paint and skin are looked at in one picture of so many, so far around a blob, and a new look has
# this weight.
_LEARN_ONE_OF, _AROUND_PX, _NEW = 5, 8, 0.1
_SQUARE, _WIDE = np.ones((3, 3), np.uint8), np.ones((5, 5), np.uint8)


class FaintFinder:
    """Finds what is left of the dots of one colour where one is missing."""

    def __init__(self) -> None:
        # Chroma (2,) about grey of paint and of the skin around it; zeros: not known yet.
        self._paint, self._skin = np.zeros(2), np.zeros(2)
        self._pictures = 0
        # How far dots moved from one picture to the next, lately.
        self._moved_px = 0.0

    def note(self, image: Picture, blobs: Sequence[Blob], moved_px: Sequence[float]) -> None:
        """Learn from a picture: from its blobs, and by how much its dots have moved to it."""
        self._moved_px = float(np.median(moved_px)) if moved_px else 0.0
        if blobs and self._pictures % _LEARN_ONE_OF == 0:
            self._learn(image, blobs)
        self._pictures += 1

    def find(
        self,
        image: Picture,
        blobs: Sequence[Blob],
        dots_px: Sequence[Point],
        area_px2: float,
        noise: float,
    ) -> list[Patch]:
        """Patches that are none of the blobs of a picture, where dots are missing among these.

        None where there are as many blobs as dots, and before paint and skin are known. dots_px:
        where dots were in the last picture; area_px2: of one that shows as a whole; noise: of
        chroma, as image.noise.Noise has it.
        """
        across = float(self._paint[0] * self._skin[1] - self._paint[1] * self._skin[0])
        lengths = float(np.linalg.norm(self._paint) * np.linalg.norm(self._skin))
        if area_px2 <= 0.0 or not abs(across) > _LEAST_SINE * lengths:
            return []
        if len(blobs) >= len(dots_px):
            return []
        diameter = math.sqrt(4.0 / math.pi * area_px2)
        missing = [
            place
            for place in dots_px
            if all(math.dist(place, (b.x_px, b.y_px)) > _OWN * diameter for b in blobs)
        ]
        if not missing:
            return []
        reach = _REACH * diameter + self._moved_px
        cells = [(int(x) // 2, int(y) // 2, int(x) // 2 + 1, int(y) // 2 + 1) for x, y in missing]
        near = search_region.bounding_rect(cells)
        # What is blurred reaches further than its middle.
        rect = search_region.around(near, math.ceil(reach + diameter), image.size)
        # Of a mean of nine cells.
        sigma = noise * float(np.linalg.norm(self._skin)) / abs(across) / 3.0
        shares = self._shares(image, rect, across)
        shares[shares < max(_SHARE, _SIGMAS * sigma)] = 0.0
        return [
            patch
            for patch in _patches(shares, rect, blobs, _SIGMA * diameter)
            if _AREAS[0] * area_px2 <= patch.area_px <= _AREAS[1] * area_px2
            and any(math.dist(place, (patch.x_px, patch.y_px)) <= reach for place in missing)
        ]

    def _learn(self, image: Picture, blobs: Sequence[Blob]) -> None:
        """What paint and the skin around it look like."""
        looks = [look for blob in blobs if (look := _look(image, blob)) is not None]
        if looks:
            paint, skin = np.median(looks, axis=0)
            weight = _NEW if self._skin.any() else 1.0
            self._paint += weight * (paint - self._paint)
            self._skin += weight * (skin - self._skin)

    def _shares(self, image: Picture, rect: Rect, across: float) -> npt.NDArray[np.float32]:
        """The share of paint in each cell (h, w) of a rectangle, 0 where it is no mixture."""
        chroma = cv2.blur(image.cells(rect)[1].astype(np.float32) - _GREY, (3, 3))
        u, v = chroma[..., 0], chroma[..., 1]
        shares = (self._skin[1] * u - self._skin[0] * v) / across
        rests = (self._paint[0] * v - self._paint[1] * u) / across
        shares[(rests < _RESTS[0]) | (rests > _RESTS[1])] = 0.0
        return shares.astype(np.float32)


def _look(image: Picture, blob: Blob) -> tuple[Array, Array] | None:
    """Chroma (2,) about grey of a blob, and of what is around it, if there is anything."""
    rect = search_region.around(blob.rect, _AROUND_PX, image.size)
    chroma = image.cells(rect)[1] - _GREY
    x0, y0, x1, y1 = (a - b for a, b in zip(blob.rect, (*rect[:2], *rect[:2]), strict=True))
    inside = np.zeros(chroma.shape[:2], np.uint8)
    inside[y0:y1, x0:x1] = blob.mask != 0
    paint = cv2.erode(inside, _SQUARE)
    if not paint.any():
        paint = inside
    around = cv2.dilate(inside, _WIDE) == 0
    if not around.any():
        return None
    return np.median(chroma[paint != 0], axis=0), np.median(chroma[around], axis=0)


def _patches(
    shares: npt.NDArray[np.float32], rect: Rect, blobs: Sequence[Blob], sigma_px: float
) -> list[Patch]:
    """What hangs together of shares (h, w) of a rectangle's cells, and touches no blob."""
    mask = (shares > 0.0).astype(np.uint8)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    found = []
    for number in range(1, count):
        x, y, w, h = boxes[number, :4].tolist()
        left, top = rect[0] + x, rect[1] + y
        if any(touch((left, top, left + w, top + h), blob.rect) for blob in blobs):
            continue
        part = (slice(y, y + h), slice(x, x + w))
        paint = np.where(labels[part] == number, shares[part], 0.0)
        total = float(paint.sum())
        rows, columns = np.indices(paint.shape)
        # The middle of a cell is between two pixels.
        x_px = 2.0 * (left + float((columns * paint).sum()) / total) + 0.5
        y_px = 2.0 * (top + float((rows * paint).sum()) / total) + 0.5
        found.append(Patch(x_px, y_px, 4.0 * total, sigma_px, _QUALITY))
    return found
