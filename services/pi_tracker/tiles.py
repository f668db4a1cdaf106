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
    """n tiles of h x w cells; images of all of them are (n, h, w), and OpenCV sees them as one of n h x w."""

    size: tuple[int, int]  # of the image, in cells
    origins: list[tuple[int, int]]  # top left cell of each tile in the image
    mask: Image  # (n, h, w) 0/1: the blobs
    inside: Image  # (n, h, w) 0/1: the image
    luma: Image  # Y - 16 of every pixel, float32 (n, 2h, 2w)
    cells: Image  # Y - 16, U - 128, V - 128 and 1 of every cell, float32 (n, h, w, 4)


def stacked(picture: Picture, blobs: Sequence[Blob]) -> Tiles:
    """Tiles around blobs, at least one."""
    rects = [_grown(blob.rect, picture.size) for blob in blobs]
    h = max(rect[3] - rect[1] for rect in rects) + _GAP
    w = max(rect[2] - rect[0] for rect in rects)
    n = len(blobs)
    mask, inside = np.zeros((2, n, h, w), np.uint8)
    luma, chroma = np.zeros((n, 2 * h, 2 * w), np.uint8), np.zeros((n, h, w, 2), np.uint8)
    for k, (blob, (x0, y0, x1, y1)) in enumerate(zip(blobs, rects, strict=True)):
        left, top, right, bottom = blob.rect
        mask[k, top - y0 : bottom - y0, left - x0 : right - x0] = blob.mask
        inside[k, : y1 - y0, : x1 - x0] = 1
        picture.copy_to((x0, y0, x1, y1), luma[k], chroma[k])
    pixels = luma.astype(np.float32)
    pixels -= 16.0
    cells = np.ones((n, h, w, 4), np.float32)
    cells[..., 0] = cv2.resize(flat(pixels), (w, n * h), interpolation=cv2.INTER_AREA).reshape(n, h, w)
    cells[..., 1:3] = chroma
    cells[..., 1:3] -= 128.0
    return Tiles(picture.size, [(rect[0], rect[1]) for rect in rects], mask, inside, pixels, cells)


def flat(images: Image) -> Image:
    """(n, h, w, ...) as one image (n h, w, ...), no copy."""
    return images.reshape(-1, *images.shape[2:])


def doubled(images: Image, interpolation: int = cv2.INTER_LINEAR) -> Image:
    """Images of cells as ones of pixels; (n, h, w) -> (n, 2h, 2w). Tiles are apart by more than interpolation reaches."""
    n, h, w = images.shape
    return cv2.resize(flat(images), (2 * w, 2 * n * h), interpolation=interpolation).reshape(n, 2 * h, 2 * w)


def moments(images: Image, order: int) -> Image:
    """Sums of each image times y^i x^j up to an order; (n, h, w) -> (n, order + 1, order + 1) indexed [i, j]."""
    _, h, w = images.shape
    return _powers(h, order).T @ (images @ _powers(w, order))


def _powers(count: int, order: int) -> Image:
    return np.arange(count, dtype=np.float32)[:, None] ** np.arange(order + 1, dtype=np.float32)


def _grown(rect: Rect, size: tuple[int, int]) -> Rect:
    x0, y0, x1, y1 = rect
    return (max(x0 - MARGIN, 0), max(y0 - MARGIN, 0), min(x1 + MARGIN, size[0]), min(y1 + MARGIN, size[1]))
