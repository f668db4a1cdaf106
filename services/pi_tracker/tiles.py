"""The surroundings of several blobs in one image, one below the other, so that one call of OpenCV or numpy works on all.

Pure. Where the image ends, a tile ends: what is not `inside` counts nowhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from services.pi_tracker.frame import Image
from services.pi_tracker.planes import Picture, Rect
from services.pi_tracker.search import Blob

# Cells around a blob: one that counts as partly painted, two in which the background is read.
MARGIN = 3
# Cells between tiles, so that windows of five cells do not mix them.
_GAP = 2


@dataclass(frozen=True, eq=False)
class Tiles:
    """n tiles of h x w cells, stacked to images of n h x w cells; luma is float32 of pixels, (2 n h, 2 w), less 16."""

    count: int
    size: tuple[int, int]  # of the image, in cells
    origins: list[tuple[int, int]]  # top left cell of each tile in the image
    mask: Image  # (n h, w) 0/1: the blobs
    inside: Image  # (n h, w) 0/1: the image
    luma: Image
    cells: tuple[Image, Image, Image]  # Y - 16, U - 128, V - 128, float32 (n h, w)

    def stack(self, plane: Image) -> Image:
        """(n h, w) -> (n, h, w), no copy."""
        return plane.reshape(self.count, -1, plane.shape[1])

    def sums(self, plane: Image, mask: Image) -> Image:
        """Sum of a plane over each tile's mask; (n,)."""
        return self.stack(plane * mask).sum((1, 2))

    def spread(self, values: Image) -> Image:
        """One value per tile as an image; (n,) -> (n h, 1), to be broadcast."""
        return values.repeat(self.mask.shape[0] // self.count)[:, None]


def stacked(picture: Picture, blobs: Sequence[Blob]) -> Tiles:
    """Tiles around blobs, at least one."""
    rects = [_grown(blob.rect, picture.size) for blob in blobs]
    h = max(rect[3] - rect[1] for rect in rects) + _GAP
    w = max(rect[2] - rect[0] for rect in rects)
    n = len(blobs)
    mask, inside = np.zeros((n, h, w), np.uint8), np.zeros((n, h, w), np.uint8)
    luma, chroma = np.zeros((n, 2 * h, 2 * w), np.uint8), np.zeros((n, h, w, 2), np.uint8)
    for k, (blob, (x0, y0, x1, y1)) in enumerate(zip(blobs, rects, strict=True)):
        bx0, by0, bx1, by1 = blob.rect
        mask[k, by0 - y0 : by1 - y0, bx0 - x0 : bx1 - x0] = blob.mask
        inside[k, : y1 - y0, : x1 - x0] = 1
        picture.copy_to((x0, y0, x1, y1), luma[k], chroma[k])
    pixels = luma.reshape(n * 2 * h, 2 * w).astype(np.float32) - np.float32(16.0)
    u, v = cv2.split(chroma.reshape(n * h, w, 2).astype(np.float32) - np.float32(128.0))
    y = cv2.resize(pixels, (w, n * h), interpolation=cv2.INTER_AREA)
    return Tiles(
        n, picture.size, [(rect[0], rect[1]) for rect in rects], mask.reshape(n * h, w), inside.reshape(n * h, w), pixels, (y, u, v)
    )


def _grown(rect: Rect, size: tuple[int, int]) -> Rect:
    x0, y0, x1, y1 = rect
    return (max(x0 - MARGIN, 0), max(y0 - MARGIN, 0), min(x1 + MARGIN, size[0]), min(y1 + MARGIN, size[1]))
