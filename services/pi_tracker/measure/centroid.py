"""Sub-pixel centroids of blobs, to a few hundredths of a pixel, with their standard deviations.

Each pixel near a blob is a mixture of paint under some light and of background
(paint_fraction.py). The centroid is weighted with the paint fraction: it is not pulled to the lit
side of a finger, and skin, wall and neighbouring fingers cancel.

The colours of paint and background are estimated twice: first inside the blob's mask and in a ring
around it, then where the fraction found so says that a cell is pure. A mask's rim holds some
background, and a ring leaves out what lies next to the edge: both bias a centre, in each camera
differently, since the background is another one there. Only the blob, one cell larger, has any
weight: weights over the whole ROI pick up neighbouring fingers (.76 px).

All blobs of a frame are measured in one stack of tiles: the cost is in the calls, not in the
pixels. Pure. A blob cut off by the image's edge, one of a paint that hardly differs from what is
around it, and one of a few cells are measured all the same, and their sigma and quality say so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import Picture
from services.pi_tracker.measure.blob_tiles import (
    GAP,
    Tiles,
    as_plane,
    cells_from_pixels,
    pixels_from_cells,
    raw_moments,
    tiles_around,
)
from services.pi_tracker.measure.centroid_sigma import misfit_sigma_px, noise_sigma_px
from services.pi_tracker.measure.grown_blob import Growth, grown
from services.pi_tracker.measure.paint_fraction import LinearLight, Mixture, PaintFraction

_SQUARE = np.ones((3, 3), np.uint8)
# In the second round, a cell's weight as pure background falls from 1 at a paint fraction of 0 to 0
# at the first of these; its weight as pure paint rises from 0 at the second to 1 at the third.
# (Error of disparity without noise, simulated hands resting at 1.0 and 0.5 m, moving at 0.7 m,
# random seeds 1-10: one round .072, .056, .137 px; two rounds .063, .048, .121; with the mask's
# core no longer taken for paint as such .056, .048, .117.)
BACKGROUND_BELOW, PAINT_ABOVE = 0.2, (0.85, 0.95)
PAINT_BAND = PAINT_ABOVE[1] - PAINT_ABOVE[0]
# As factors of the fraction and summands: 1 - fraction / BACKGROUND_BELOW and
# (fraction - PAINT_ABOVE[0]) / PAINT_BAND.
_PURE_FACTOR = np.array([-1.0 / BACKGROUND_BELOW, 1.0 / PAINT_BAND], np.float32)
_PURE_OFFSET = np.array([1.0, -PAINT_ABOVE[0] / PAINT_BAND], np.float32)
# Weight of a cell that the mask takes for pure, but the paint fraction does not: it decides only
# where no other cell is pure.
MASK_ONLY_WEIGHT = 1e-3
# The paint fraction is noisy about 0 and 1; this slope about 1/2 lets clipping remove most of that
# noise at little loss of sub-pixel position (disparity RMS at sigma 5: slope 1.5 .052, 2 .053, 3
# .056 px; absolute error .237, .223, .209).
SLOPE = 2.0
# Cores smaller than this hold no pure paint; then the whole mask must do.
MIN_CORE_CELLS = 3
# Paint this far from its surroundings in chroma per luma is distinguished without doubt; the paints
# of the simulator lie at .4 to .7.
FULL_CONTRAST = 0.25
# Of a blob without paint after all.
LOST_SIGMA_PX = 2.0
# The image's edge cuts off between none and half of a blob, which moves the centre by up to a
# quarter of its width: what it adds to sigma, per square root of the area, and a factor of quality.
CUT_SIGMA, CUT_QUALITY = 0.15, 0.4
# A disc fills pi / 4 of its box, of few cells less: so much of it, and quality is full.
DISC_FILL = 0.7
# Blobs of up to this size share one stack; larger ones have their own, so that not every tile
# grows.
_MAX_STACKED_CELLS = 26


class Centroid(NamedTuple):
    """Position of a blob in px, covered area in px^2.

    sigma_px is one standard deviation of each coordinate, quality is 0..1.
    """

    x_px: float
    y_px: float
    area_px: float
    sigma_px: float
    quality: float


class _TileMoments(NamedTuple):
    """What the centroid of one blob is made of."""

    weights: list[list[float]]  # (2, 2) raw moments of the pixels' weights
    variances: list[list[float]]  # (3, 3) of the variances of the cells that noise can move
    edge_cells: float  # as many cells as have weights that are neither 0 nor 1
    contrast: float


def centroids(
    picture: Picture, blobs: Sequence[Blob], noise: Noise, growth: Growth | None = None
) -> list[Centroid]:
    """Measure blobs, grown first if growth is given; one result each, in their order."""
    if growth is not None:
        blobs = [
            grown(picture, growth.near.table, *one)
            for one in zip(blobs, growth.limits, strict=True)
        ]
    small = [blob for blob in blobs if _size(blob) <= _MAX_STACKED_CELLS]
    measured: dict[int, Centroid] = {}
    if small:
        stack = _measure(tiles_around(picture, small), small, noise)
        measured = dict(zip(map(id, small), stack, strict=True))
    for blob in blobs:
        if id(blob) not in measured:
            measured[id(blob)] = _measure(tiles_around(picture, [blob]), [blob], noise)[0]
    return [measured[id(blob)] for blob in blobs]


def _size(blob: Blob) -> int:
    return max(blob.rect[2] - blob.rect[0], blob.rect[3] - blob.rect[1])


def _measure(tiles: Tiles, blobs: Sequence[Blob], noise: Noise) -> list[Centroid]:
    masks = _Masks.of(tiles)
    mixture = _two_round_mixture(tiles, masks)
    paint = mixture.fraction(noise)
    weight = _pixel_weights(tiles, paint, masks.reach)
    # Where clipping holds the weight at 0 or 1, noise does not move it.
    partly = np.ceil(weight)
    partly -= np.floor(weight)
    edge = cells_from_pixels(partly)
    moments = zip(
        raw_moments(weight, 1).tolist(),
        raw_moments(edge * paint.variance, 2).tolist(),
        raw_moments(edge, 0).ravel().tolist(),
        mixture.contrast(),
        strict=True,
    )
    return [
        _centroid(tiles, k, blobs[k], _TileMoments(*of_blob)) for k, of_blob in enumerate(moments)
    ]


class _Masks(NamedTuple):
    """Cells about the blobs, 0/1; (h, n, w) each."""

    reach: Image  # a cell larger than the blob: what may have any weight
    # float32 (2, h, n, w), of background and of paint: what may be pure, and what the mask takes
    # for pure.
    may_be_pure: Image
    pure_by_mask: Image

    @classmethod
    def of(cls, tiles: Tiles) -> _Masks:
        h, n, w = tiles.mask.shape
        masks = np.empty((4, h, n, w), np.uint8)
        reach = _dilated(tiles.mask)
        masks[0] = band = _dilated(reach)
        masks[1] = tiles.mask
        np.bitwise_xor(band, reach, out=masks[2])
        core = cv2.erode(
            as_plane(tiles.mask), _SQUARE, borderType=cv2.BORDER_CONSTANT, borderValue=0
        )
        masks[3] = core.reshape(h, n, w)
        pure = masks.astype(np.float32)
        core_cells = raw_moments(pure[3], 0)
        if core_cells.min() < MIN_CORE_CELLS:
            few = core_cells.ravel() < MIN_CORE_CELLS
            pure[3][:, few] = pure[1][:, few]
        return cls(reach, pure[:2], pure[2:])


def _pixel_weights(tiles: Tiles, paint: PaintFraction, reach: Image) -> Image:
    """The weight of every pixel, 0..1: its paint fraction, steeper and clipped; (2h, n, 2w).

    Chroma is known of cells only. Luma is known of pixels: the fraction follows it linearly.
    """
    h, n, w = paint.fraction.shape
    # Not clipped yet, a pixel's weight is ramp[0] + ramp[1] times its luma.
    ramp = np.empty((h, 2, n, w), np.float32)
    slope = np.multiply(paint.by_luma, SLOPE, out=ramp[:, 1])
    constant = paint.fraction * SLOPE
    constant += 0.5 - 0.5 * SLOPE
    np.subtract(constant, slope * tiles.cells[0], out=ramp[:, 0])
    # Where a tile ends it goes on as it is: gaps show nothing, and the next tile is another place.
    ramp[..., -GAP] = ramp[..., -GAP - 1]
    ramp[:, :, :-1, -1] = ramp[:, :, 1:, 0]
    ramp[:, 0, -1, -1] = ramp[:, 1, 0, 0]
    ramp = pixels_from_cells(ramp)
    weight = ramp[:, 1] * tiles.luma
    weight += ramp[:, 0]
    most = pixels_from_cells(reach.astype(np.float32), cv2.INTER_NEAREST)
    np.minimum(weight, most, out=weight)
    return np.maximum(weight, 0.0, out=weight)


def _two_round_mixture(tiles: Tiles, masks: _Masks) -> Mixture:
    """Paint and background of every cell.

    First pure cells are as the mask has them, then as the paint fraction that follows says.
    """
    light = LinearLight(tiles.cells)
    fraction = Mixture(light, masks.pure_by_mask, rough=True).shade_free_fraction()
    pure = fraction * _PURE_FACTOR[:, None, None, None]
    pure += _PURE_OFFSET[:, None, None, None]
    np.minimum(pure, masks.may_be_pure, out=pure)
    np.maximum(pure, masks.pure_by_mask * MASK_ONLY_WEIGHT, out=pure)
    return Mixture(light, pure)


def _dilated(masks: Image) -> Image:
    """Masks one cell larger, where the image does not end."""
    dilated = cv2.dilate(as_plane(masks), _SQUARE).reshape(masks.shape)
    dilated[:, :, -GAP:] = 0
    return dilated


def lost(blob: Blob) -> Centroid:
    """Of a blob in which the paint fraction finds no paint."""
    return Centroid(blob.x_px, blob.y_px, blob.area_px, LOST_SIGMA_PX, 0.0)


def _centroid(tiles: Tiles, k: int, blob: Blob, moments: _TileMoments) -> Centroid:
    """The centroid of tile k from its moments."""
    m = moments.weights
    area = m[0][0]
    if area < 1.0:
        return lost(blob)
    x, y = m[0][1] / area, m[1][0] / area
    noise_px = noise_sigma_px(moments.variances, area, x, y, SLOPE)
    sigma = math.hypot(noise_px, misfit_sigma_px(4.0 * moments.edge_cells, area))
    left, top, right, bottom = blob.rect
    fill = blob.cells / (DISC_FILL * (right - left) * (bottom - top))
    quality = min(1.0, fill) * min(1.0, moments.contrast / FULL_CONTRAST)
    if min(left, top) <= 0 or right >= tiles.size[0] or bottom >= tiles.size[1]:
        quality *= CUT_QUALITY
        sigma += CUT_SIGMA * area**0.5
    origin_x, origin_y = tiles.origins[k]
    return Centroid(2 * origin_x + x, 2 * origin_y + y, area, sigma, quality)
