"""Where the blobs' paint is, to a few hundredths of a pixel, and how sure that is.

Each pixel near a blob is a mixture of paint under some light and of what lies behind. With chroma C = (U, V) and luma Y linear in
the mixture, the paint's chroma per luma p and the background's s (both free of shading), the luma that the paint contributes is
    a = (C - s Y) . (p - s) / |p - s|^2,
what is left, Y - a, comes from behind. With the lumas of pure paint Yp and pure background Yb, the share of paint that fits both
best is
    (a Yp + (Yb - (Y - a)) Yb) / (Yp^2 + Yb^2).
The centroid is weighted with that share: it is not pulled to the lit side of a finger, and skin, wall and neighbouring fingers
cancel. s and Yb are those of the nearest cells of the ring around the blob, each side of the edge its own: skin lies on one side and
the room, which is another one in each camera, on the others. Yp is carried outwards from the core over a short distance, as light
falls off across a finger. Only the blob, one cell larger, counts: weights over the whole ROI pick up neighbouring fingers (.76 px).

All blobs of a frame are measured in one stack of tiles: the cost is in the calls, not in the pixels. Pure. A blob cut off by the
image's edge, one of a paint that hardly differs from what is around it, and one of a few cells are measured all the same, and
their sigma and quality say so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from services.pi_tracker.frame import Image
from services.pi_tracker.noise import Noise
from services.pi_tracker.planes import Picture
from services.pi_tracker.search import Blob
from services.pi_tracker.tiles import Tiles, doubled, flat, halved, moments, stacked

_SQUARE = np.ones((3, 3), np.uint8)
# The background beside a pixel is that of the ring's cells weighted with a Gaussian of so many cells: the nearest count. (Error of
# disparity, simulated hands at 1.0, 0.5 and moving at 0.7 m: mean of a ring's 5 x 5 cells .110, .082, .165 px; this .086, .076, .150.
# Even the true background, known in every pixel, would hardly be better: .069 against .076 without noise at 1.0 m.)
_NEAR_CELLS, _BACKGROUND_CELLS = 0.8, 5
# Paint luma is that of the next neighbours (absolute error with one value for all .36 px, with 5 cells .21, with 3 .18).
_PAINT_CELLS = 3
# The share of paint is noisy about 0 and 1; this slope about 1/2 lets clipping remove most of that noise at little loss of
# sub-pixel position (disparity RMS at sigma 5: slope 1.5 .052, 2 .053, 3 .056 px; absolute error .237, .223, .209).
_SLOPE = 2.0
# Weight of the mean of all known cells beside that of near ones: nothing where there are any (a Gaussian two cells off is .0005),
# everything where there are none.
_FAINT = 1e-5
# Cores smaller than this hold no pure paint; then the whole mask must do.
_MIN_CORE = 3
# Luma below which a ratio of chroma to luma is noise.
_DARKEST = 8.0
# What noise does not explain, px: light, shade and what lies behind move the centre by this much, near or far; and more, the vaguer its
# edge is, i.e. the wider than 1.85 px the band in which the share of paint is neither 0 nor 1 (blur, coloured light, dark sides). Fitted
# to the simulator's hands (noise taken off): .08-.11 still at 0.5 and 1.0 m, .14-.17 moving at 0.7 m, .57 and .78 where the band is 2.3
# and 2.8 px, in coloured light. Error over sigma is then .8-.9 still, 1.2 moving and in coloured light.
_MISFIT_PX, _MISFIT_PER_PX, _SHARP_PX = 0.12, 1.0, 1.85
# Paint this far from its surroundings in chroma per luma is told from them without doubt; the paints of the simulator lie at .4 to .7.
_CONTRAST = 0.25
# Of a blob without any paint when looked at closely.
_LOST_SIGMA_PX = 2.0
# The centre of what the image's edge leaves of a blob says little: between none and half of it is missing, which moves the centre by
# up to a quarter of its width; and by this much less sure it is.
_CUT_SIGMA, _CUT_QUALITY = 0.15, 0.4
# Blobs of up to this size share one stack; larger ones have their own, lest every tile grow.
_STACK_CELLS = 26


class Centroid(NamedTuple):
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
    reach = _dilated(tiles.mask, _SQUARE)
    paint = _paint(tiles, reach)
    share = doubled(paint.offset) - tiles.luma * doubled(paint.slope)
    weight = _SLOPE * share + (0.5 - 0.5 * _SLOPE)
    np.minimum(weight, 1.0, out=weight)
    np.maximum(weight, 0.0, out=weight)
    weight *= doubled(reach, cv2.INTER_NEAREST)
    # Where clipping holds the weight, noise does not move it.
    moving = halved(np.logical_and(weight > 0.0, weight < 1.0).astype(np.float32))
    sums = moments(weight, 1).swapaxes(0, 1).tolist()
    spreads = moments(moving * paint.variance(noise), 2).swapaxes(0, 1).tolist()
    moved = (4.0 * moments(moving, 0).ravel()).tolist()
    contrast = paint.contrast.tolist()
    return [_centroid(tiles, k, blob, sums[k], spreads[k], moved[k], contrast[k]) for k, blob in enumerate(blobs)]


@dataclass(frozen=True, eq=False)
class _Paint:
    """The share of paint of a pixel as offset - slope * Y, per cell, (h, n, w)."""

    offset: Image
    slope: Image
    # The share's derivative by the cell's chroma, squared.
    by_chroma2: Image
    # How far the paint's chroma per luma lies from what is around the blob, on average; (n,).
    contrast: Image

    def variance(self, noise: Noise) -> Image:
        """Of the share, for the mean of a cell's four pixels; (h, n, w)."""
        return (self.slope * noise.luma) ** 2 + self.by_chroma2 * noise.chroma**2


def _paint(tiles: Tiles, reach: Image) -> _Paint:
    ring = (_dilated(reach, _SQUARE) - reach) & tiles.inside
    (y_b, u_b, v_b), around = _carried(tiles.cells, ring, _near)
    (y_p, *_), paint = _carried(tiles.cells, _cores(tiles.mask), _next)
    y_b, y_p = np.maximum(y_b, _DARKEST), np.maximum(y_p, _DARKEST)
    s_u, s_v = u_b / y_b, v_b / y_b
    p_uv, s_uv = paint[1:3] / np.maximum(paint[0], _DARKEST), around[1:3] / np.maximum(around[0], _DARKEST)  # (2, n)
    d_u, d_v = p_uv[0, :, None] - s_u, p_uv[1, :, None] - s_v
    norm = np.maximum(d_u * d_u + d_v * d_v, 1e-6)
    scale = 1.0 / (y_p * y_p + y_b * y_b)
    p_norm, q = (y_p + y_b) * scale / norm, y_b * scale
    g_u, g_v = d_u * p_norm, d_v * p_norm
    offset = tiles.cells[:, 1] * g_u + tiles.cells[:, 2] * g_v + y_b * q
    return _Paint(offset, s_u * g_u + s_v * g_v + q, p_norm * p_norm * norm, np.hypot(*(p_uv - s_uv)))


def _cores(mask: Image) -> Image:
    """The masks without their edges, where anything is left of them."""
    core = cv2.erode(flat(mask), _SQUARE, borderType=cv2.BORDER_CONSTANT, borderValue=0).reshape(mask.shape)
    few = core.sum((0, 2)) < _MIN_CORE
    if few.any():
        core[:, few] = mask[:, few]
    return core


def _dilated(masks: Image, element: Image) -> Image:
    return cv2.dilate(flat(masks), element).reshape(masks.shape)


def _near(image: Image) -> Image:
    return cv2.GaussianBlur(image, (_BACKGROUND_CELLS, _BACKGROUND_CELLS), _NEAR_CELLS, borderType=cv2.BORDER_CONSTANT)


def _next(image: Image) -> Image:
    return cv2.blur(image, (_PAINT_CELLS, _PAINT_CELLS), borderType=cv2.BORDER_CONSTANT)


def _carried(cells: Image, known: Image, spread: Callable[[Image], Image]) -> tuple[Image, Image]:
    """Y, U, V where they are known, spread by a filter, and their mean where that does not reach.

    cells (h, 4, n, w), known (h, n, w) -> (3, h, n, w), and the means (3, n).
    """
    h, _, n, w = cells.shape
    kept = cells * known[:, None]
    total = moments(kept.reshape(h, 4 * n, w), 0).reshape(4, n)
    mean = total[:3] / np.maximum(total[3], 1.0)
    window = spread(flat(kept)).reshape(kept.shape)
    window[:, :3] += _FAINT * mean[:, :, None]
    return (window[:, :3] / (window[:, 3:] + _FAINT)).swapaxes(0, 1), mean


def _centroid(
    tiles: Tiles, k: int, blob: Blob, sums: list[list[float]], spread: list[list[float]], moving_px: float, contrast: float
) -> Centroid:
    """From the tile's moments: of the weights, and of the variance of those that noise can move."""
    area = sums[0][0]
    if area < 1.0:
        return Centroid(blob.x_px, blob.y_px, blob.area_px, _LOST_SIGMA_PX, 0.0)
    x, y = sums[0][1] / area, sums[1][0] / area
    sigma = math.hypot(_sigma(spread, area, x, y), _misfit(moving_px, area))
    left, top, right, bottom = blob.rect
    # A disc fills pi / 4 of its box.
    quality = min(1.0, blob.cells / (0.7 * (right - left) * (bottom - top))) * min(1.0, contrast / _CONTRAST)
    if min(left, top) <= 0 or right >= tiles.size[0] or bottom >= tiles.size[1]:
        quality *= _CUT_QUALITY
        sigma += _CUT_SIGMA * area**0.5
    return Centroid(2 * tiles.origins[k][0] + x, 2 * tiles.origins[k][1] + y, area, sigma, quality)


def _sigma(spread: list[list[float]], area: float, x: float, y: float) -> float:
    """Standard deviation of each coordinate from the noise, px; spread has the moments of the cells' variances."""
    # Cells' own coordinates, of which one is two pixels wide.
    x, y = (x - 0.5) / 2.0, (y - 0.5) / 2.0
    about = spread[0][2] + spread[2][0] - 2.0 * (x * spread[0][1] + y * spread[1][0]) + (x * x + y * y) * spread[0][0]
    # Four pixels that move together: 4^2 times the cell's variance; pixels for cells: 2^2; the mean of two coordinates: 1 / 2.
    return _SLOPE * math.sqrt(32.0 * max(about, 0.0)) / area


def _misfit(moving_px: float, area: float) -> float:
    """Standard deviation of each coordinate from light and blur, px."""
    radius = math.sqrt(area / math.pi)
    # The band of a disc has an area of 2 pi r times its width.
    band_px = moving_px / (2.0 * math.pi * radius)
    return _MISFIT_PX + _MISFIT_PER_PX * max(band_px - _SHARP_PX, 0.0)
