"""Where the blobs' paint is, to a few hundredths of a pixel, and how sure that is.

Each pixel near a blob is a mixture of paint under some light and of what lies behind (mixture.py).
The centroid is weighted with the share of paint: it is not pulled to the lit side of a finger, and
skin, wall and neighbouring fingers cancel. What paint and background look like is read twice: first
inside the blob's mask and in a ring around it, then where the share found so says that there is
nothing else. A mask's rim holds some background, and a ring leaves out what lies next to the edge:
both bias a centre, in each camera differently, since the background is another one there. Only the
blob, one cell larger, counts: weights over the whole ROI pick up neighbouring fingers (.76 px).

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

from services.pi_tracker.detect.blob_search import Blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import Picture
from services.pi_tracker.measure.blob_tiles import Tiles, doubled, flat, halved, moments, stacked
from services.pi_tracker.measure.paint_fraction import Light, Mixture

_SQUARE = np.ones((3, 3), np.uint8)
# In the second round, cells count as background the more the further their share of paint lies
# below the first; as paint from the second to the third. (Error of disparity without noise,
# simulated hands resting at 1.0 and 0.5 m, moving at 0.7 m, seeds 1-10: one round .072, .056, .137
# px; two rounds .063, .048, .121; with the mask's core no longer taken for paint as such .056,
# .048, .117.)
_BARE, _PURE = 0.2, (0.85, 0.95)
# As factors of the share and summands: 1 - share / _BARE, (share - _PURE[0]) / (_PURE[1] -
# _PURE[0]).
_ALONE_BY = np.array([-1.0 / _BARE, 1.0 / (_PURE[1] - _PURE[0])], np.float32)[:, None, None, None]
_ALONE_AT = np.array([1.0, -_PURE[0] / (_PURE[1] - _PURE[0])], np.float32)[:, None, None, None]
# Weight of a cell that only the mask takes for background or for paint, where the share of paint
# finds none.
_HARDLY = 1e-3
# The share of paint is noisy about 0 and 1; this slope about 1/2 lets clipping remove most of that
# noise at little loss of sub-pixel position (disparity RMS at sigma 5: slope 1.5 .052, 2 .053, 3
# .056 px; absolute error .237, .223, .209).
_SLOPE = 2.0
# Cores smaller than this hold no pure paint; then the whole mask must do.
_MIN_CORE = 3
# What noise does not explain, px: light, shade and what lies behind move the centre by this much,
# near or far; and more, the vaguer its edge is, i.e. the wider than 1.75 px the band in which the
# share of paint is neither 0 nor 1 (blur, coloured light, dark sides). RMS of the simulator's
# hands, seeds 1-10: .09 px resting at 0.5 and 1.0 m, .14 moving at 0.7 m (.2 where the band is
# wider than 1.8 px), .47 and .65 in coloured light where it is 2.1 and 2.4 px. Error over sigma is
# then .7-.8 resting, 1.1 moving, 1.25 in coloured light.
_MISFIT_PX, _MISFIT_PER_PX, _SHARP_PX = 0.1, 1.0, 1.75
# Paint this far from its surroundings in chroma per luma is told from them without doubt; the
# paints of the simulator lie at .4 to .7.
_CONTRAST = 0.25
# Of a blob without any paint when looked at closely.
_LOST_SIGMA_PX = 2.0
# The centre of what the image's edge leaves of a blob says little: between none and half of it is
# missing, which moves the centre by up to a quarter of its width; and by this much less sure it is.
_CUT_SIGMA, _CUT_QUALITY = 0.15, 0.4
# Blobs of up to this size share one stack; larger ones have their own, lest every tile grow.
_STACK_CELLS = 26


class Centroid(NamedTuple):
    """Position of a blob in px, covered area in px^2, one standard deviation of each coordinate in
    px, quality 0..1.
    """

    x_px: float
    y_px: float
    area_px: float
    sigma_px: float
    quality: float


def centroids(picture: Picture, blobs: Sequence[Blob], noise: Noise) -> list[Centroid]:
    """Measure blobs; one result each, in their order."""
    small = [blob for blob in blobs if _size(blob) <= _STACK_CELLS]
    measured = (
        dict(zip(map(id, small), _measure(stacked(picture, small), small, noise), strict=True))
        if small
        else {}
    )
    for blob in blobs:
        if id(blob) not in measured:
            measured[id(blob)] = _measure(stacked(picture, [blob]), [blob], noise)[0]
    return [measured[id(blob)] for blob in blobs]


def _size(blob: Blob) -> int:
    return max(blob.rect[2] - blob.rect[0], blob.rect[3] - blob.rect[1])


def _measure(tiles: Tiles, blobs: Sequence[Blob], noise: Noise) -> list[Centroid]:
    reach = np.bitwise_and(_dilated(tiles.mask, _SQUARE), tiles.inside)
    mixture = _mixture(tiles, reach)
    share, by_luma, variance = mixture.share(noise)
    # The weight of a pixel, not clipped yet, is the sum of the first and of its luma times the
    # second.
    h, n, w = share.shape
    ramp = np.empty((h, 2, n, w), np.float32)
    np.multiply(by_luma, _SLOPE, out=ramp[:, 1])
    share *= _SLOPE
    share += 0.5 - 0.5 * _SLOPE
    np.subtract(share, ramp[:, 1] * tiles.cells[0], out=ramp[:, 0])
    ramp = doubled(ramp)
    weight = ramp[:, 1] * tiles.luma
    weight += ramp[:, 0]
    np.minimum(weight, doubled(reach.astype(np.float32), cv2.INTER_NEAREST), out=weight)
    np.maximum(weight, 0.0, out=weight)
    # Where clipping holds the weight at 0 or 1, noise does not move it.
    moving = halved(np.ceil(weight) - np.floor(weight))
    centres = moments(weight, 1).swapaxes(0, 1).tolist()
    spreads = moments(moving * variance, 2).swapaxes(0, 1).tolist()
    moved = (4.0 * moments(moving, 0).ravel()).tolist()
    contrast = mixture.contrast().tolist()
    return [
        _centroid(tiles, k, blob, centres[k], spreads[k], moved[k], contrast[k])
        for k, blob in enumerate(blobs)
    ]


def _mixture(tiles: Tiles, reach: Image) -> Mixture:
    """Paint and background of every cell: first as the mask has them, then as the share of paint
    does that follows from those.
    """
    light = Light(tiles.cells)
    # Of background and of paint: cells that may show it, and those that do as the mask has it.
    may, do = np.empty((2, 2, *reach.shape), np.float32)
    band = np.bitwise_and(_dilated(reach, _SQUARE), tiles.inside)
    may[0], may[1] = band, tiles.mask
    core = cv2.erode(flat(tiles.mask), _SQUARE, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    do[0], do[1] = np.bitwise_xor(band, reach), core.reshape(reach.shape)
    few = moments(do[1], 0).ravel() < _MIN_CORE
    if few.any():
        do[1][:, few] = may[1][:, few]
    share = Mixture(light, do, rough=True).ratio()
    alone = share * _ALONE_BY
    alone += _ALONE_AT
    np.minimum(alone, may, out=alone)
    do *= _HARDLY
    np.maximum(alone, do, out=alone)
    return Mixture(light, alone)


def _dilated(masks: Image, element: Image) -> Image:
    return cv2.dilate(flat(masks), element).reshape(masks.shape)


def _centroid(
    tiles: Tiles,
    k: int,
    blob: Blob,
    sums: list[list[float]],
    spread: list[list[float]],
    moving_px: float,
    contrast: float,
) -> Centroid:
    """From the tile's moments: of the weights, and of the variance of those that noise can move."""
    area = sums[0][0]
    if area < 1.0:
        return Centroid(blob.x_px, blob.y_px, blob.area_px, _LOST_SIGMA_PX, 0.0)
    x, y = sums[0][1] / area, sums[1][0] / area
    sigma = math.hypot(_sigma(spread, area, x, y), _misfit(moving_px, area))
    left, top, right, bottom = blob.rect
    # A disc fills pi / 4 of its box.
    quality = min(1.0, blob.cells / (0.7 * (right - left) * (bottom - top))) * min(
        1.0, contrast / _CONTRAST
    )
    if min(left, top) <= 0 or right >= tiles.size[0] or bottom >= tiles.size[1]:
        quality *= _CUT_QUALITY
        sigma += _CUT_SIGMA * area**0.5
    return Centroid(2 * tiles.origins[k][0] + x, 2 * tiles.origins[k][1] + y, area, sigma, quality)


def _sigma(spread: list[list[float]], area: float, x: float, y: float) -> float:
    """Standard deviation of each coordinate from the noise, px.

    Spread has the moments of the cells' variances.
    """
    # Cells' own coordinates, of which one is two pixels wide.
    x, y = (x - 0.5) / 2.0, (y - 0.5) / 2.0
    about = (
        spread[0][2]
        + spread[2][0]
        - 2.0 * (x * spread[0][1] + y * spread[1][0])
        + (x * x + y * y) * spread[0][0]
    )
    # Four pixels that move together: 4^2 times the cell's variance; pixels for cells: 2^2; the mean
    # of two coordinates: 1 / 2.
    return _SLOPE * math.sqrt(32.0 * max(about, 0.0)) / area


def _misfit(moving_px: float, area: float) -> float:
    """Standard deviation of each coordinate from light and blur, px."""
    radius = math.sqrt(area / math.pi)
    # The band of a disc has an area of 2 pi r times its width.
    band_px = moving_px / (2.0 * math.pi * radius)
    return _MISFIT_PX + _MISFIT_PER_PX * max(band_px - _SHARP_PX, 0.0)
