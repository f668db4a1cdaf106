"""The share of paint in a cell that shows paint and what lies behind, both in lights of their own.

Light mixes, not grey levels: a lens blurs light, and a camera encodes it afterwards, with a power of about 1 / 2.2 (IEC 61966-2-1).
Half paint and half of a wall four times brighter looks like more than half a wall when grey levels are taken for light. So levels
are decoded first. In light, with chroma C = (U, V) and luma Y, the paint's chroma per luma p and the background's s (both free of
shading), the luma that the paint contributes is
    a = (C - s Y) . (p - s) / |p - s|^2,
what is left, Y - a, comes from behind. With the lumas of pure paint Yp and pure background Yb, the share of paint that fits both
best is
    (a Yp + (Yb - (Y - a)) Yb) / (Yp^2 + Yb^2).
p, Yp, s and Yb are those of the nearest cells that show paint alone or background alone: skin lies on one side and the room, which is
another one in each camera, on the others; and a highlight whitens the middle of a tip, not its edge (Shafer, Using color to separate
reflection components, 1985). Pure.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from services.pi_tracker.frame import Image
from services.pi_tracker.noise import Noise
from services.pi_tracker.tiles import flat, moments

# BT.601 in limited range: Y - 16, U - 128, V - 128 to R, G, B in 0..255, and back.
_RGB = np.array([[1.164, 0.0, 1.596], [1.164, -0.392, -0.813], [1.164, 2.017, 0.0]], np.float32)
# Levels 0..255 to the power of 1.5, on the same scale. Decoding all the way (2.2) suits the mixture better, but a dark side of a finger,
# whose shade is never known well, weighs more there: disparity error without noise, hands resting at 1.0 and 0.5 m, and scatter at 1.0 m:
# power 1 .094, .069, .065 px; 1.5 .070, .055, .060; 2 .074, .065, .063.
_YUV_FROM_POWER = (np.linalg.inv(_RGB) / 255.0**0.5).astype(np.float32)
# Of x^1.5 the derivative is 1.5 x^.5.
_POWER_SLOPES = 1.5 * _YUV_FROM_POWER.T
# The background of a cell is that of its next neighbours (Gaussian of so many cells). Its paint's luma, which falls off across a finger,
# is the mean of 3 x 3 cells, its colour that of 5 x 5: with 3 there is more noise, with all of a large marker's cells its highlight.
_NEAR_CELLS, _LUMA_CELLS, _COLOR_CELLS = 0.6, 3, 5
# Weight of the mean of all known cells beside that of near ones: nothing where there are any, everything where there are none.
_FAINT = 1e-5
# Luma, of 255, below which a ratio of chroma to luma is noise.
_DARKEST = 1.0


class Light:
    """Cells in linear light: Y, U, V of it, 0..255 from black to white, and 1; (h, 4, n, w)."""

    def __init__(self, cells: Image) -> None:
        """Cells as cameras encode them: Y - 16, U - 128, V - 128 and 1, float32 (h, 4, n, w)."""
        h, _, n, w = cells.shape
        rgb = _RGB @ cells[:, :3].reshape(h, 3, n * w)
        # Noise may be negative.
        root = np.sqrt(np.abs(rgb))
        rgb *= root
        self.cells = np.ones_like(cells)
        self.cells[:, :3] = (_YUV_FROM_POWER @ rgb).reshape(h, 3, n, w)
        self._root = root

    def encoded(self, slopes: Image) -> Image:
        """Derivatives (h, 3, n, w) by Y, U and V of light as those by Y, U and V as encoded."""
        h, _, n, w = slopes.shape
        by_rgb = _POWER_SLOPES @ slopes.reshape(h, 3, n * w)
        by_rgb *= self._root
        return np.asarray(_RGB.T @ by_rgb).reshape(slopes.shape)


class Mixture:
    """What is paint and what background around every cell, given where either is seen alone."""

    def __init__(self, light: Light, behind: Image, paint: Image, *, rough: bool = False) -> None:
        """behind, paint: weights (h, n, w) of the cells that show nothing but background, nothing but paint; rough: shade less local."""
        self._light = light
        known, self._around = _known(light.cells, behind)
        b = _spread(_near, known)
        known, self._paint = _known(light.cells, paint)
        p = _spread(_wide, known)
        self._y_b = np.maximum(b[:, :1], _DARKEST)
        y_p = np.maximum(p[:, :1], _DARKEST)
        self._y_p = y_p if rough else np.maximum(_spread(_next, known[:, ::3]), _DARKEST)
        s = b[:, 1:] / self._y_b
        d = p[:, 1:] / y_p
        d -= s
        norm = d * d
        d /= np.maximum(norm[:, :1] + norm[:, 1:], 1e-6)
        s *= d
        # The paint's luma is the sum of these times Y, U and V; (h, 3, n, w).
        self._slopes = np.concatenate((-(s[:, :1] + s[:, 1:]), d), 1)
        parts = light.cells[:, :3] * self._slopes
        self._luma = parts[:, 0] + parts[:, 1] + parts[:, 2]

    def ratio(self) -> Image:
        """The share of paint, 0..1, for paint and background in the same shade, which may be another one than where they are seen alone."""
        paint = np.maximum(self._luma / self._y_p[:, 0], 0.0)
        behind = np.maximum((self._light.cells[:, 0] - self._luma) / self._y_b[:, 0], 0.0)
        return np.asarray(paint / np.maximum(paint + behind, 0.05))

    def share(self, noise: Noise) -> tuple[Image, Image, Image]:
        """The share of paint that fits its luma and the background's best, noisy about 0 and 1; its derivative by luma as encoded; its
        variance for a cell's noise; (h, n, w) each."""
        scale = 1.0 / (self._y_p * self._y_p + self._y_b * self._y_b)
        behind = self._y_b * scale
        both = behind + self._y_p * scale
        share = both[:, 0] * self._luma + behind[:, 0] * (self._y_b[:, 0] - self._light.cells[:, 0])
        slopes = self._slopes * both
        slopes[:, :1] -= behind
        slopes = self._light.encoded(slopes)
        by_luma = slopes[:, 0].copy()
        slopes *= slopes
        return share, by_luma, slopes[:, 0] * noise.luma**2 + (slopes[:, 1] + slopes[:, 2]) * noise.chroma**2

    def contrast(self) -> Image:
        """How far the paint's chroma per luma lies from what is around the blob, on average, in light; (n,)."""
        paint, around = (mean[1:3] / np.maximum(mean[0], _DARKEST) for mean in (self._paint, self._around))
        return np.hypot(*(paint - around))


def _near(image: Image) -> Image:
    return cv2.GaussianBlur(image, (3, 3), _NEAR_CELLS, borderType=cv2.BORDER_CONSTANT)


def _next(image: Image) -> Image:
    return cv2.blur(image, (_LUMA_CELLS, _LUMA_CELLS), borderType=cv2.BORDER_CONSTANT)


def _wide(image: Image) -> Image:
    return cv2.blur(image, (_COLOR_CELLS, _COLOR_CELLS), borderType=cv2.BORDER_CONSTANT)


def _known(cells: Image, weight: Image) -> tuple[Image, Image]:
    """Cells (h, 4, n, w) times a weight (h, n, w), with their weighted mean faintly everywhere, and that mean; (4, n), its last is 1."""
    h, _, n, w = cells.shape
    known = cells * weight[:, None]
    mean = moments(known.reshape(h, 4 * n, w), 0).reshape(4, n)
    mean /= np.maximum(mean[3], 1e-6)
    known += _FAINT * mean[:, :, None]
    return known, mean


def _spread(window: Callable[[Image], Image], known: Image) -> Image:
    """Values that a window carries on from where they are known; (h, c + 1, n, w), the last of which is the weight -> (h, c, n, w)."""
    spread = window(flat(known)).reshape(known.shape)
    return np.asarray(spread[:, :-1] / np.maximum(spread[:, -1:], 1e-9))
