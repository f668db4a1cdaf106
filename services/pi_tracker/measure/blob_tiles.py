"""Tiles: the surroundings of several blobs side by side in one image.

One call of OpenCV or numpy then works on all blobs. Side by side, not one below the other: OpenCV's
filters cost by the row. Pure. Where the image ends, a tile ends: what is not `inside` counts
nowhere.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.yuv_planes import Picture, Rect

# Cells around a blob: one that counts as partly painted, one in which the background is read.
MARGIN = 2
# Cells between tiles, so that windows of five cells do not mix them.
_GAP = 2


@dataclass(frozen=True, eq=False)
class Tiles:
    """n tiles of h x w cells.

    An image of all of them is (h, n, w), and OpenCV sees it as one of h x (n w).
    """

    size: tuple[int, int]  # of the image, in cells
    origins: list[tuple[int, int]]  # top left cell of each tile in the image
    mask: Image  # (h, n, w) 0/1: the blobs
    inside: Image  # (h, n, w) 0/1: the image, as far as MARGIN reaches
    luma: Image  # (2h, n, 2w) Y - 16 of every pixel, float32
    cells: Image  # (4, h, n, w) Y - 16, U - 128, V - 128 and 1 of every cell, float32


def tiles_around(picture: Picture, blobs: Sequence[Blob]) -> Tiles:
    """Tiles around blobs, at least one."""
    rects = [_with_margin(blob.rect, picture.size) for blob in blobs]
    h = max(rect[3] - rect[1] for rect in rects)
    w = max(rect[2] - rect[0] for rect in rects) + _GAP
    n = len(blobs)
    mask, inside = np.zeros((h, n, w), np.uint8), np.ones((h, n, w), np.uint8)
    luma_bytes = np.zeros((2 * h, n, 2 * w), np.uint8)
    chroma_bytes = np.zeros((2, h, n, w), np.uint8)
    for k, (blob, rect) in enumerate(zip(blobs, rects, strict=True)):
        left, top, right, bottom = blob.rect
        x0, y0, x1, y1 = rect
        mask[top - y0 : bottom - y0, k, left - x0 : right - x0] = blob.mask
        picture.copy_to(rect, luma_bytes[:, k], chroma_bytes[:, :, k])
        if x1 < right + MARGIN or y1 < bottom + MARGIN:
            inside[y1 - y0 :, k], inside[:, k, x1 - x0 :] = 0, 0
    np.minimum(mask, 1, out=mask)
    luma = luma_bytes.astype(np.float32)
    luma -= 16.0
    cells = np.ones((4, h, n, w), np.float32)
    cells[0] = cells_from_pixels(luma)
    np.subtract(chroma_bytes, np.float32(128.0), out=cells[1:3])
    return Tiles(picture.size, [rect[:2] for rect in rects], mask, inside, luma, cells)


def as_plane(images: Image) -> Image:
    """(h, ..., w) as one image (h, ... w), no copy if it is contiguous."""
    return images.reshape(images.shape[0], -1)


def pixels_from_cells(images: Image, interpolation: int = cv2.INTER_LINEAR) -> Image:
    """Images of cells, upsampled to pixels; (h, ..., w) -> (2h, ..., 2w).

    Tiles are apart by more than interpolation reaches.
    """
    h, *between, w = images.shape
    plane = as_plane(images)
    size = (2 * plane.shape[1], 2 * h)
    return cv2.resize(plane, size, interpolation=interpolation).reshape(2 * h, *between, 2 * w)


def cells_from_pixels(images: Image) -> Image:
    """Images of pixels as means of cells; (2h, n, 2w) -> (h, n, w)."""
    h, n, w = images.shape
    size = (n * w // 2, h // 2)
    plane = cv2.resize(as_plane(images), size, interpolation=cv2.INTER_AREA)
    return plane.reshape(h // 2, n, w // 2)


def raw_moments(images: Image, order: int) -> Image:
    """Raw moments: sums of each image times y^i x^j up to an order.

    (h, n, w) -> (order + 1, n, order + 1) indexed [i, :, j].
    """
    h, n, w = images.shape
    rows = _powers(h, order).T @ as_plane(images)  # (order + 1, n w)
    return np.asarray(rows.reshape(order + 1, n, w) @ _powers(w, order))


def tile_sums(images: Image) -> Image:
    """Sums of each image; (m, h, c, n, w) -> (m, c, n)."""
    m, h, c, n, w = images.shape
    rows = _powers(h, 0).T @ images.reshape(m, h, c * n * w)
    return np.asarray(rows.reshape(m, c, n, w) @ _powers(w, 0)[:, 0])


@functools.lru_cache(maxsize=256)
def column_weights(width: int) -> Image:
    """1 for a tile's columns, next to nothing for the gap after it, so no sum is 0 there; (w,)."""
    return np.repeat(np.array([1.0, 1e-6], np.float32), (width - _GAP, _GAP))


@functools.lru_cache(maxsize=256)
def _powers(count: int, order: int) -> Image:
    return np.arange(count, dtype=np.float32)[:, None] ** np.arange(order + 1, dtype=np.float32)


def _with_margin(rect: Rect, size: tuple[int, int]) -> Rect:
    x0, y0, x1, y1 = rect
    return (
        max(x0 - MARGIN, 0),
        max(y0 - MARGIN, 0),
        min(x1 + MARGIN, size[0]),
        min(y1 + MARGIN, size[1]),
    )
