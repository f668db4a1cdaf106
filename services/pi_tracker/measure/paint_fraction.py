"""Linear unmixing: the fraction of a cell that shows paint, the rest being background.

Light mixes, not grey levels. A lens blurs light, and a camera encodes it afterwards, with a power
of about 1 / 2.2 (IEC 61966-2-1). Half paint and half of a wall four times brighter looks like more
than half a wall when grey levels are taken for light. So levels are decoded first (LinearLight).

In light, a cell has chroma C = (U, V) and luma Y. Let p be the paint's chroma per luma and s the
background's; both are free of shading. The luma that the paint contributes is
    a = (C - s Y) . (p - s) / |p - s|^2,
and what is left, Y - a, comes from behind. With the lumas of pure paint Yp and pure background Yb,
the paint fraction that fits both best is
    (a Yp + (Yb - (Y - a)) Yb) / (Yp^2 + Yb^2).

p, Yp, s and Yb are those of the nearest pure cells, i.e. cells that show paint alone or background
alone. Skin lies on one side and the room, which is another one in each camera, on the others; and a
highlight whitens the middle of a tip, not its edge (Shafer, Using color to separate reflection
components, 1985). Pure.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import cv2
import numpy as np

from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.measure.blob_tiles import GAP, powers

# BT.601 in limited range: Y - 16, U - 128, V - 128 to R, G, B in 0..255. Rounded to three digits,
# unlike image/hue.py: measured figures are with these.
RGB = np.array([[1.164, 0.0, 1.596], [1.164, -0.392, -0.813], [1.164, 2.017, 0.0]], np.float32)
# From levels 0..255 to the power of 1.5 back to Y, U, V on the same scale. Decoding all the way
# (2.2) suits the mixture better, but a dark side of a finger, whose shade is never known well,
# weighs more there: disparity error without noise, hands resting at 1.0 and 0.5 m, and scatter at
# 1.0 m: power 1 .094, .069, .065 px; 1.5 .070, .055, .060; 2 .074, .065, .063.
YUV_FROM_POWER = (np.linalg.inv(RGB) / 255.0**0.5).astype(np.float32)
# Both for what ends with a 1, which they leave.
_RGB1, _YUV1_FROM_POWER = np.eye(4, dtype=np.float32), np.eye(4, dtype=np.float32)
_RGB1[:3, :3], _YUV1_FROM_POWER[:3, :3] = RGB, YUV_FROM_POWER
# Of x^1.5 the derivative is 1.5 x^.5.
POWER_SLOPES = 1.5 * YUV_FROM_POWER.T
# The background of a cell is that of its direct neighbours (Gaussian of so many cells). Its paint's
# luma, which falls off across a finger, is the mean of 3 x 3 cells, its colour that of 5 x 5: with
# 3 there is more noise, with all of a large marker's cells its highlight.
BLUR = cv2.getGaussianKernel(3, 0.6, cv2.CV_32F)
_ROW3, _ROW5 = np.full(3, 1 / 3, np.float32), np.full(5, 1 / 5, np.float32)
# Weight of the mean of all pure cells beside that of near ones: nothing where there are any,
# everything where there are none.
FALLBACK_WEIGHT = 1e-5
# Luma, of 255, below which a ratio of chroma to luma is noise. (1, so that a sum of weighted lumas
# may be compared with that of weights.)
DARKEST = 1.0


class LinearLight:
    """Cells in linear light: Y, U, V of it, 0..255 from black to white, and 1.

    cells is (4, h, n, w); rows holds the same as (h, 4, n, w), contiguous.
    """

    def __init__(self, cells: Image) -> None:
        """Decodes cells of the camera: Y - 16, U - 128, V - 128 and 1, float32 (4, h, n, w)."""
        rgb = np.dot(_RGB1, cells.reshape(4, -1))
        # Noise may be negative.
        root = np.abs(rgb)
        np.sqrt(root, out=root)
        rgb *= root
        self.cells = np.dot(_YUV1_FROM_POWER, rgb).reshape(cells.shape)
        self.rows = np.ascontiguousarray(self.cells.swapaxes(0, 1))
        self._root = root[:3]

    def derivative_by_encoded(self, slopes: Image) -> Image:
        """Chain rule: derivatives (3, h, n, w) by Y, U, V of light, as those by Y, U, V encoded."""
        by_rgb = np.dot(POWER_SLOPES, slopes.reshape(3, -1))
        by_rgb *= self._root
        return np.dot(RGB.T, by_rgb).reshape(slopes.shape)


class PaintFraction(NamedTuple):
    """The paint fraction of cells, noisy about 0 and 1; (h, n, w) each."""

    fraction: Image
    by_luma: Image  # its derivative by luma as encoded
    variance: Image  # its variance for a cell's noise


class Mixture:
    """What is paint and what background around every cell, given cells where either is pure."""

    def __init__(self, light: LinearLight, pure: Image, *, rough: bool = False) -> None:
        """pure: weights (2, h, n, w) of the cells that show only background, and only paint.

        rough: the paint's luma from 5 x 5 cells, too.
        """
        self._light = light
        known, self._means = _weighted_cells(light.rows, pure)
        _, h, _, n, w = known.shape
        planes = known.reshape(2, h, 4 * n * w)
        # Y, U, V and weight in windows about every cell, of background and of paint.
        near = np.empty_like(planes)
        _filtered(planes[0], BLUR, near[0])
        _filtered(planes[1], _ROW5, near[1])
        by_channel = near.reshape(2, h, 4, n * w)
        luma = np.maximum(by_channel[:, :, 0], by_channel[:, :, 3])
        chroma = np.empty((2, 2, h, n * w), np.float32)
        np.divide(by_channel[:, :, 1:3].swapaxes(1, 2), luma[:, None], out=chroma)
        luma /= by_channel[:, :, 3]
        if not rough:
            luma_and_weight = known[1, :, ::3].reshape(h, 2 * n * w)
            nearest = _filtered(luma_and_weight, _ROW3).reshape(h, 2, n * w)
            np.maximum(nearest[:, 0], nearest[:, 1], out=luma[1])
            luma[1] /= nearest[:, 1]
        self._y_b, self._y_p = luma.reshape(2, h, n, w)
        s, d = chroma.reshape(2, 2, h, n, w)
        d -= s
        norm = d * d
        norm[0] += norm[1]
        np.maximum(norm[0], 1e-6, out=norm[0])
        # Now d = (p - s) / |p - s|^2, and s its product with the background's chroma per luma.
        d /= norm[0]
        s *= d
        # The paint's luma a is the sum of U and V times d, less s[0] + s[1] times Y.
        self._by_chroma, self._by_luma = d, s[0] + s[1]
        parts = light.cells[1:3] * d
        self._paint_luma = parts[0]
        self._paint_luma += parts[1]
        self._paint_luma -= light.cells[0] * self._by_luma

    def shade_free_fraction(self) -> Image:
        """The paint fraction (h, n, w), 0..1, if paint and background are in the same shade.

        That may be another shade than where they are pure.
        """
        paint = np.maximum(self._paint_luma, 0.0)
        paint /= self._y_p
        behind = self._light.cells[0] - self._paint_luma
        np.maximum(behind, 0.0, out=behind)
        behind /= self._y_b
        behind += paint
        np.maximum(behind, 0.05, out=behind)
        return np.asarray(paint / behind)

    def fraction(self, noise: Noise) -> PaintFraction:
        """The paint fraction that fits the paint's luma and the background's best."""
        norm = self._y_p * self._y_p
        norm += self._y_b * self._y_b
        behind = self._y_b / norm
        both = self._y_p / norm
        both += behind
        fraction = both * self._paint_luma
        fraction += behind * (self._y_b - self._light.cells[0])
        slopes = np.empty_like(self._light.cells[:3])
        np.multiply(self._by_chroma, both, out=slopes[1:])
        both *= self._by_luma
        both += behind
        np.negative(both, out=slopes[0])
        slopes = self._light.derivative_by_encoded(slopes)
        squares = slopes * slopes
        variance = squares[1]
        variance += squares[2]
        variance *= noise.chroma**2
        variance += squares[0] * noise.luma**2
        return PaintFraction(fraction, slopes[0], variance)

    def contrast(self) -> list[float]:
        """Distance of the paint's mean chroma per luma from the background's, in light; of each."""
        # Of as few numbers, Python's arithmetic takes half as long as numpy's.
        return [
            math.hypot(
                u / max(y, DARKEST) - u_b / max(y_b, DARKEST),
                v / max(y, DARKEST) - v_b / max(y_b, DARKEST),
            )
            for y_b, u_b, v_b, y, u, v in self._means[:, :3].reshape(6, -1).T.tolist()
        ]


def _filtered(plane: Image, row: Image, into: Image | None = None) -> Image:
    # Not cv2.GaussianBlur, which takes half as long again; nor cv2.blur, whose running sums leave
    # rounding errors where there is next to nothing: weights would not stay above 0.
    return cv2.sepFilter2D(plane, -1, row, row, into, borderType=cv2.BORDER_CONSTANT)


def _weighted_cells(rows: Image, weights: Image) -> tuple[Image, Image]:
    """Cells (h, 4, n, w) times each weight (2, h, n, w), and their weighted means.

    The cells are (2, h, 4, n, w), with their mean faintly everywhere; the means (2, 4, n), of which
    the last of the four is 1.
    """
    h, c, n, w = rows.shape
    known = rows * weights[:, :, None]
    runs = known.reshape(2, h, c * n * w)
    sums = np.matmul(powers(h, 0).T, runs)
    mean = np.asarray(sums.reshape(2, c, n, w) @ powers(w, 0)[:, 0])
    mean /= np.maximum(mean[:, 3:], 1e-6)
    mean[:, 3] = 1.0
    # In runs as long as rows: half the time of short ones.
    runs += (mean[..., None] * _faint(w)).reshape(2, 1, c * n * w)
    return known, mean


@functools.lru_cache(maxsize=256)
def _faint(width: int) -> Image:
    """FALLBACK_WEIGHT for a tile's columns, next to nothing for the gap at its end; (w,).

    So windows do not reach the next tile, and no sum is 0 there.
    """
    weights = np.repeat(np.array([1.0, 1e-6], np.float32), (width - GAP, GAP))
    return FALLBACK_WEIGHT * weights
