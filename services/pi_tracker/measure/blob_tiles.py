"""Tiles: the surroundings of several blobs side by side in one image.

One call of OpenCV or numpy then works on all blobs. Side by side, not one below the other: OpenCV's
filters cost by the row. Pure.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.yuv_planes import Picture

# Cells around a blob: one that counts as partly painted, one in which the background is read.
MARGIN = 2
# Cells between tiles, so that windows of five cells do not mix them.
GAP = 2


@dataclass(frozen=True, eq=False)
class Tiles:
    """n tiles of h x w cells.

    An image of all of them is (h, n, w), and OpenCV sees it as one of h x (n w). The last columns
    of each are a gap.
    """

    size: tuple[int, int]  # of the image, in cells
    origins: list[tuple[int, int]]  # top left cell of each tile in the image
    mask: Image  # (h, n, w) 0/1: the blobs
    luma: Image  # (2h, n, 2w) Y - 16 of every pixel, float32
    cells: Image  # (4, h, n, w) Y - 16, U - 128, V - 128 and 1 of every cell, float32


def tiles_around(picture: Picture, blobs: Sequence[Blob]) -> Tiles:
    """Tiles around blobs, at least one."""
    width, height = picture.size
    rects = [blob.rect for blob in blobs]
    w = min(max([rect[2] - rect[0] for rect in rects]) + 2 * MARGIN, width)
    h = min(max([rect[3] - rect[1] for rect in rects]) + 2 * MARGIN, height)
    n = len(blobs)
    mask = np.zeros((h, n, w + GAP), np.uint8)
    pixels = np.zeros((2 * h, n, 2 * (w + GAP)), np.uint8)
    chroma = np.zeros((2, h, n, w + GAP), np.uint8)
    origins = []
    for k, (left, top, right, bottom) in enumerate(rects):
        # Where the image ends, a tile ends, too.
        x, y = max(min(left - MARGIN, width - w), 0), max(min(top - MARGIN, height - h), 0)
        origins.append((x, y))
        mask[top - y : bottom - y, k, left - x : right - x] = blobs[k].mask
        picture.copy_to((x, y, x + w, y + h), pixels[:, k, : 2 * w], chroma[:, :, k, :w])
    np.minimum(mask, 1, out=mask)
    luma = pixels.astype(np.float32)
    luma -= 16.0
    cells = np.ones((4, *mask.shape), np.float32)
    cells[0] = cells_from_pixels(luma)
    cells[1:3] = chroma
    cells[1:3] -= 128.0
    return Tiles(picture.size, origins, mask, luma, cells)


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

    (h, n, w) -> (n, order + 1, order + 1) indexed [:, i, j].
    """
    h, n, w = images.shape
    rows = np.dot(powers(h, order).T, images.reshape(h, n * w))  # (order + 1, n w)
    return np.asarray(rows.reshape(order + 1, n, w) @ powers(w, order)).swapaxes(0, 1)


@functools.lru_cache(maxsize=256)
def powers(count: int, order: int) -> Image:
    """Powers 0 to order of the first whole numbers; (count, order + 1)."""
    return np.arange(count, dtype=np.float32)[:, None] ** np.arange(order + 1, dtype=np.float32)
