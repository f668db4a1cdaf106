"""Where the blobs' paint is, to a few hundredths of a pixel, and how sure that is.

Each pixel near a blob is a mixture of paint under some light and of what lies behind. With chroma C = (U, V) and luma Y linear in
the mixture, the paint's chroma per luma p and the background's s (both free of shading), the luma that the paint contributes is
    a = (C - s Y) . (p - s) / |p - s|^2,
what is left, Y - a, comes from behind. With the lumas of pure paint Yp and pure background Yb, the share of paint that fits both
best is
    (a Yp + (Yb - (Y - a)) Yb) / (Yp^2 + Yb^2).
The centroid is weighted with that share: it is not pulled to the lit side of a finger, and skin, wall and neighbouring fingers
cancel. s and Yb are taken from the ring around the blob and carried inwards, Yp from its core and carried outwards, each over a
short distance, as skin lies on one side and the room on the others, and light falls off across a finger. Only the blob, one cell
larger, counts: weights over the whole ROI pick up neighbouring fingers (.76 px).

All blobs of a frame are measured in one stack of tiles: the cost is in the calls, not in the pixels. Pure. A blob cut off by the
image's edge, one of a paint that hardly differs from what is around it, and one of a few cells are measured all the same, and
their sigma and quality say so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from services.pi_tracker.frame import Image
from services.pi_tracker.noise import Noise
from services.pi_tracker.planes import Picture
from services.pi_tracker.search import Blob
from services.pi_tracker.tiles import Tiles, stacked

_SQUARE = np.ones((3, 3), np.uint8)
_WIDE = np.ones((5, 5), np.uint8)
# Background is averaged over this many cells, paint luma over the next neighbours (absolute error on the simulator's hands .36 px with
# one value for all, .21 with 7 and 5 cells, .18 with 5 and 3).
_BACKGROUND_CELLS, _PAINT_CELLS = 5, 3
# The share of paint is noisy about 0 and 1; this slope about 1/2 lets clipping remove most of that noise at little loss of
# sub-pixel position (disparity RMS at sigma 5: slope 1.5 .052, 2 .053, 3 .056 px; absolute error .237, .223, .209).
_SLOPE = 2.0
# Cores smaller than this hold no pure paint; then the whole mask must do.
_MIN_CORE = 3
# Luma below which a ratio of chroma to luma is noise.
_DARKEST = 8.0
# What noise does not explain: light that changes across the paint moves its centre by this share of its radius, the more the vaguer
# its edge is, i.e. the wider than 1.6 px the band in which the share of paint is neither 0 nor 1 (blur, coloured light, dark sides).
# Fitted to the simulator's hands: error over sigma .9-1.1 in four scenes, sharp ones and one with blur and coloured light, where a
# constant gave 1.5-5.9.
_MISFIT, _MISFIT_PER_PX, _SHARP_PX = 0.016, 0.12, 1.6
# Paint this far from its surroundings in chroma per luma is told from them without doubt; the paints of the simulator lie at .4 to .7.
_CONTRAST = 0.25
# Of a blob without any paint when looked at closely.
_LOST_SIGMA_PX = 2.0
# The centre of what the image's edge leaves of a blob says little: between none and half of it is missing, which moves the centre by
# up to a quarter of its width; and by this much less sure it is.
_CUT_SIGMA, _CUT_QUALITY = 0.15, 0.4
# Blobs of up to this size share one stack; larger ones have their own, lest every tile grow.
_STACK_CELLS = 26


@dataclass(frozen=True)
class Centroid:
    """Position of a blob in px, covered area in px^2, one standard deviation of each coordinate in px, quality 0..1."""

    x_px: float
    y_px: float
    area_px: float
    sigma_px: float
    quality: float


def centroids(picture: Picture, blobs: Sequence[Blob], noise: Noise) -> list[Centroid]:
    """Measure blobs; one result each, in their order."""
    small = [blob for blob in blobs if _size(blob) <= _STACK_CELLS]
    measured = dict(zip(map(id, small), _measure(stacked(picture, small), small, noise), strict=True)) if small else {}
    for blob in blobs:
        if id(blob) not in measured:
            measured[id(blob)] = _measure(stacked(picture, [blob]), [blob], noise)[0]
    return [measured[id(blob)] for blob in blobs]


def _size(blob: Blob) -> int:
    return max(blob.rect[2] - blob.rect[0], blob.rect[3] - blob.rect[1])


def _measure(tiles: Tiles, blobs: Sequence[Blob], noise: Noise) -> list[Centroid]:
    reach = cv2.dilate(tiles.mask, _SQUARE)
    paint = _Paint.of(tiles, reach)
    share = cv2.resize(paint.offset, None, fx=2, fy=2) - tiles.luma * cv2.resize(paint.slope, None, fx=2, fy=2)
    weight = np.clip(_SLOPE * share + (0.5 - 0.5 * _SLOPE), 0.0, 1.0)
    weight *= cv2.resize(reach, None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
    area, x, y = _moments(weight.reshape(tiles.count, -1, weight.shape[1]))
    # Where clipping holds the weight, noise does not move it.
    moving = ((weight > 0.0) & (weight < 1.0)).astype(np.float32)
    cells = tiles.stack(cv2.resize(moving, paint.slope.shape[::-1], interpolation=cv2.INTER_AREA))
    sigma = _sigma(cells * tiles.stack(paint.variance(noise)), area, x, y)
    unsure = _misfit(4.0 * cells.sum((1, 2)), area)
    found = np.stack([area, x, y, np.hypot(sigma, unsure), _contrast(tiles, paint)], axis=1).tolist()
    return [_centroid(tiles, k, blob, *values) for k, (blob, values) in enumerate(zip(blobs, found, strict=True))]


@dataclass(frozen=True, eq=False)
class _Paint:
    """The share of paint of a pixel as offset - slope * Y, per cell; (n h, w) each."""

    offset: Image
    slope: Image
    # The share's derivative by the cell's chroma, squared.
    by_chroma2: Image
    # 1 / |p - s|
    inverse_contrast: Image

    def variance(self, noise: Noise) -> Image:
        """Of the share, for the mean of a cell's four pixels; (n h, w)."""
        return (self.slope * noise.luma) ** 2 + self.by_chroma2 * noise.chroma**2

    @staticmethod
    def of(tiles: Tiles, reach: Image) -> _Paint:
        ring = (cv2.dilate(reach, _WIDE) - reach) & tiles.inside
        core = _cores(tiles)
        y, u, v = tiles.cells
        y_b, u_b, v_b = (_carried(tiles, plane, ring, _BACKGROUND_CELLS) for plane in (y, u, v))
        y_p = np.maximum(_carried(tiles, y, core, _PAINT_CELLS), _DARKEST)
        y_b = np.maximum(y_b, _DARKEST)
        total = np.maximum(tiles.sums(y, core), _DARKEST)
        s_u, s_v = u_b / y_b, v_b / y_b
        d_u = tiles.spread(tiles.sums(u, core) / total) - s_u
        d_v = tiles.spread(tiles.sums(v, core) / total) - s_v
        norm = np.maximum(d_u * d_u + d_v * d_v, 1e-6)
        g_u, g_v = d_u / norm, d_v / norm
        scale = 1.0 / (y_p * y_p + y_b * y_b)
        p, q = (y_p + y_b) * scale, y_b * scale
        return _Paint((u * g_u + v * g_v) * p + y_b * q, (s_u * g_u + s_v * g_v) * p + q, p * p / norm, 1.0 / np.sqrt(norm))


def _cores(tiles: Tiles) -> Image:
    core = cv2.erode(tiles.mask, _SQUARE, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    few = tiles.spread((tiles.stack(core).sum((1, 2)) < _MIN_CORE).astype(np.uint8))
    return np.where(few, tiles.mask, core)


def _carried(tiles: Tiles, plane: Image, known: Image, size: int) -> Image:
    """A plane where it is known, averaged over size x size cells, and its mean where that does not reach; (n h, w)."""
    weights = known.astype(np.float32)
    count = cv2.boxFilter(weights, -1, (size, size), normalize=False, borderType=cv2.BORDER_CONSTANT)
    total = cv2.boxFilter(plane * weights, -1, (size, size), normalize=False, borderType=cv2.BORDER_CONSTANT)
    mean = tiles.spread(tiles.sums(plane, known) / np.maximum(tiles.stack(weights).sum((1, 2)), 1.0))
    return np.where(count > 0.5, total / np.maximum(count, 0.5), mean)


def _moments(weight: Image) -> tuple[Image, Image, Image]:
    """Area and centre of each tile's weights, in pixels of the tile; (n, h, w) -> three of (n,)."""
    columns, rows = weight.sum(1), weight.sum(2)
    area = rows.sum(1)
    safe = np.maximum(area, 1e-6)
    return area, columns @ np.arange(weight.shape[2]) / safe, rows @ np.arange(weight.shape[1]) / safe


def _sigma(variance: Image, area: Image, x: Image, y: Image) -> Image:
    """Standard deviation of each coordinate from the noise, px; variance (n, h, w) of cells that can move, the others (n,)."""
    columns, rows = variance.sum(1), variance.sum(2)
    across = 2.0 * np.arange(variance.shape[2]) + 0.5 - x[:, None]
    along = 2.0 * np.arange(variance.shape[1]) + 0.5 - y[:, None]
    # A cell is four pixels that move together: the sum over pixels has a variance of 4^2 times the cell's.
    total = 16.0 * _SLOPE**2 * ((columns * across**2).sum(1) + (rows * along**2).sum(1)) / 2.0
    return np.sqrt(total) / np.maximum(area, 1.0)


def _misfit(moving_px: Image, area: Image) -> Image:
    """Standard deviation of each coordinate from light and blur, px; (n,)."""
    radius = np.sqrt(area / np.pi)
    # The band of a disc has an area of 2 pi r times its width.
    band_px = moving_px / np.maximum(2.0 * np.pi * radius, 1.0)
    return radius * (_MISFIT + _MISFIT_PER_PX * np.maximum(band_px - _SHARP_PX, 0.0))


def _contrast(tiles: Tiles, paint: _Paint) -> Image:
    """How far the paint's chroma per luma lies from what is around the blob, mean over the blob; (n,)."""
    inverse = tiles.sums(paint.inverse_contrast, tiles.mask) / np.maximum(tiles.stack(tiles.mask).sum((1, 2)), 1)
    return 1.0 / np.maximum(inverse, 1e-3)


def _centroid(tiles: Tiles, k: int, blob: Blob, area: float, x: float, y: float, sigma: float, contrast: float) -> Centroid:
    if area < 1.0:
        return Centroid(*blob.centre_px, blob.area_px, _LOST_SIGMA_PX, 0.0)
    left, top, right, bottom = blob.rect
    # A disc fills pi / 4 of its box.
    quality = min(1.0, blob.cells / (0.7 * (right - left) * (bottom - top))) * min(1.0, contrast / _CONTRAST)
    if min(left, top) <= 0 or right >= tiles.size[0] or bottom >= tiles.size[1]:
        quality *= _CUT_QUALITY
        sigma += _CUT_SIGMA * area**0.5
    return Centroid(2 * tiles.origins[k][0] + x, 2 * tiles.origins[k][1] + y, area, sigma, quality)
