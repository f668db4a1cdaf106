"""The share of paint in a cell that shows paint and what lies behind, both in lights of their own.

Light mixes, not grey levels: a lens blurs light, and a camera encodes it afterwards, with a power
of about 1 / 2.2 (IEC 61966-2-1). Half paint and half of a wall four times brighter looks like more
than half a wall when grey levels are taken for light. So levels are decoded first. In light, with
chroma C = (U, V) and luma Y, the paint's chroma per luma p and the background's s (both free of
shading), the luma that the paint contributes is
    a = (C - s Y) . (p - s) / |p - s|^2,
what is left, Y - a, comes from behind. With the lumas of pure paint Yp and pure background Yb, the
share of paint that fits both best is
    (a Yp + (Yb - (Y - a)) Yb) / (Yp^2 + Yb^2).
p, Yp, s and Yb are those of the nearest cells that show paint alone or background alone: skin lies
on one side and the room, which is another one in each camera, on the others; and a highlight
whitens the middle of a tip, not its edge (Shafer, Using color to separate reflection components,
1985). Pure.
"""

from __future__ import annotations

import cv2
import numpy as np

from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.measure.blob_tiles import flat, own, sums

# BT.601 in limited range: Y - 16, U - 128, V - 128 to R, G, B in 0..255, and back.
_RGB = np.array([[1.164, 0.0, 1.596], [1.164, -0.392, -0.813], [1.164, 2.017, 0.0]], np.float32)
# Levels 0..255 to the power of 1.5, on the same scale. Decoding all the way (2.2) suits the mixture
# better, but a dark side of a finger, whose shade is never known well, weighs more there: disparity
# error without noise, hands resting at 1.0 and 0.5 m, and scatter at 1.0 m: power 1 .094, .069,
# .065 px; 1.5 .070, .055, .060; 2 .074, .065, .063.
_YUV_FROM_POWER = (np.linalg.inv(_RGB) / 255.0**0.5).astype(np.float32)
# Both for what ends with a 1, which they leave.
_RGB1, _YUV1_FROM_POWER = np.eye(4, dtype=np.float32), np.eye(4, dtype=np.float32)
_RGB1[:3, :3], _YUV1_FROM_POWER[:3, :3] = _RGB, _YUV_FROM_POWER
# Of x^1.5 the derivative is 1.5 x^.5.
_POWER_SLOPES = 1.5 * _YUV_FROM_POWER.T
# The background of a cell is that of its next neighbours (Gaussian of so many cells). Its paint's
# luma, which falls off across a finger, is the mean of 3 x 3 cells, its colour that of 5 x 5: with
# 3 there is more noise, with all of a large marker's cells its highlight.
_NEAR_CELLS, _LUMA, _COLOR = 0.6, np.full(3, 1 / 3, np.float32), np.full(5, 1 / 5, np.float32)
# Weight of the mean of all known cells beside that of near ones: nothing where there are any,
# everything where there are none.
_FAINT = 1e-5
# Luma, of 255, below which a ratio of chroma to luma is noise. (1, so that a sum of weighted lumas
# may be compared with that of weights.)
_DARKEST = 1.0


class Light:
    """Cells in linear light: Y, U, V of it, 0..255 from black to white, and 1.

    (4, h, n, w), and beside each other: rows, (h, 4, n, w).
    """

    def __init__(self, cells: Image) -> None:
        """Cells as cameras encode them: Y - 16, U - 128, V - 128 and 1, float32 (4, h, n, w)."""
        rgb = _RGB1 @ cells.reshape(4, -1)
        # Noise may be negative.
        root = np.sqrt(np.abs(rgb))
        rgb *= root
        self.cells = np.asarray(_YUV1_FROM_POWER @ rgb).reshape(cells.shape)
        self.rows = np.ascontiguousarray(self.cells.swapaxes(0, 1))
        self._root = root[:3]

    def encoded(self, slopes: Image) -> Image:
        """Derivatives (3, h, n, w) by Y, U and V of light as those by Y, U and V as encoded."""
        by_rgb = _POWER_SLOPES @ slopes.reshape(3, -1)
        by_rgb *= self._root
        return np.asarray(_RGB.T @ by_rgb).reshape(slopes.shape)


class Mixture:
    """What is paint and what background around every cell, given where either is seen alone."""

    def __init__(self, light: Light, alone: Image, *, rough: bool = False) -> None:
        """alone: weights (2, h, n, w) of the cells that show nothing but background, nothing but
        paint; rough: shade less local.
        """
        self._light = light
        known, self._means = _known(light.rows, alone)
        s, self._y_b = _seen(_near(known[0]))
        d, self._y_p = _seen(_wide(known[1]))
        if not rough:
            shade = _next(known[1][:, ::3])
            self._y_p = np.maximum(shade[:, 0], shade[:, 1]) / shade[:, 1]
        d -= s
        norm = d * d
        norm[0] += norm[1]
        np.maximum(norm[0], 1e-6, out=norm[0])
        d /= norm[0]
        s *= d
        # The paint's luma is that sum of U and V less this times Y.
        self._by_chroma, self._by_luma = d, s[0] + s[1]
        parts = light.cells[1:3] * d
        self._luma = parts[0]
        self._luma += parts[1]
        self._luma -= light.cells[0] * self._by_luma

    def ratio(self) -> Image:
        """The share of paint, 0..1, for paint and background in the same shade, which may be
        another one than where they are seen alone.
        """
        paint = np.maximum(self._luma, 0.0)
        paint /= self._y_p
        behind = self._light.cells[0] - self._luma
        np.maximum(behind, 0.0, out=behind)
        behind /= self._y_b
        behind += paint
        np.maximum(behind, 0.05, out=behind)
        return np.asarray(paint / behind)

    def share(self, noise: Noise) -> tuple[Image, Image, Image]:
        """The share of paint that fits its luma and the background's best, noisy about 0 and 1; its
        derivative by luma as encoded; its variance for a cell's noise; (h, n, w) each.
        """
        norm = self._y_p * self._y_p
        norm += self._y_b * self._y_b
        behind = self._y_b / norm
        both = self._y_p / norm
        both += behind
        share = both * self._luma
        share += behind * (self._y_b - self._light.cells[0])
        slopes = np.empty_like(self._light.cells[:3])
        np.multiply(self._by_chroma, both, out=slopes[1:])
        both *= self._by_luma
        both += behind
        np.negative(both, out=slopes[0])
        slopes = self._light.encoded(slopes)
        squares = slopes * slopes
        variance = squares[1]
        variance += squares[2]
        variance *= noise.chroma**2
        variance += squares[0] * noise.luma**2
        return share, slopes[0], variance

    def contrast(self) -> Image:
        """How far the paint's chroma per luma lies from what is around the blob, on average, in
        light; (n,).
        """
        around, paint = self._means[:, 1:3] / np.maximum(self._means[:, :1], _DARKEST)
        return np.hypot(*(paint - around))


def _near(image: Image) -> Image:
    return cv2.GaussianBlur(
        flat(image), (3, 3), _NEAR_CELLS, borderType=cv2.BORDER_CONSTANT
    ).reshape(image.shape)


def _next(image: Image) -> Image:
    return _mean(image, _LUMA)


def _wide(image: Image) -> Image:
    return _mean(image, _COLOR)


def _mean(image: Image, row: Image) -> Image:
    # Not cv2.blur, whose running sums leave rounding errors where there is next to nothing: weights
    # would not stay above 0.
    return cv2.sepFilter2D(flat(image), -1, row, row, borderType=cv2.BORDER_CONSTANT).reshape(
        image.shape
    )


def _known(rows: Image, weights: Image) -> tuple[Image, Image]:
    """Cells (h, 4, n, w) times each weight (2, h, n, w), with their weighted mean faintly
    everywhere, (2, h, 4, n, w), and those means, of which the last is 1, (2, 4, n).
    """
    h, c, n, w = rows.shape
    known = rows * weights[:, :, None]
    mean = sums(known)
    mean /= np.maximum(mean[:, 3:], 1e-6)
    mean[:, 3] = 1.0
    # Nothing between tiles, lest windows see the next one's; in runs as long as rows: half the time
    # of short ones.
    runs = known.reshape(2, h, c * n * w)
    runs += ((_FAINT * mean)[..., None] * own(w)).reshape(2, 1, c * n * w)
    return known, mean


def _seen(spread: Image) -> tuple[Image, Image]:
    """Chroma per luma (2, h, n, w) and luma (h, n, w) of what a window carries on from where it is
    known: Y, U, V and weight, summed, (h, 4, n, w).
    """
    h, _, n, w = spread.shape
    luma = np.maximum(spread[:, 0], spread[:, 3])
    chroma = np.empty((2, h, n, w), np.float32)
    np.divide(spread[:, 1:3].swapaxes(0, 1), luma, out=chroma)
    luma /= spread[:, 3]
    return chroma, luma
