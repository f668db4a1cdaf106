"""From linear light to the planes of a YUV420 picture: lens blur, gamma, averaged chroma. Compiled
kernels. Pure.

YUV is BT.601 with limited range, what cv2.COLOR_YUV2BGR_I420 undoes; `full_range` makes the other
one of it. A camera averages the chroma
of each 2x2 pixels; OpenCV's own BGR2YUV_I420 takes one of the four, which moves edges by half a
pixel.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import Ints
from services.simulator.render.projection import Array32

# The sRGB curve as a table over the square root of light: nearly a line, so 1024 steps are exact to
# 0.05 grey levels.
_STEPS = 1024
# Levels of full-range luma over those of limited range (chroma: 255 / 224).
FULL_OVER_LIMITED = 255.0 / 219.0


class Planes(NamedTuple):
    """A YUV420 picture before noise and rounding."""

    luma: Array32  # (h, w)
    chroma: Array32  # (2, h / 2, w / 2): U and V


def empty_planes(width: int, height: int) -> Planes:
    """Room for a picture."""
    return Planes(
        np.empty((height, width), np.float32), np.empty((2, height // 2, width // 2), np.float32)
    )


def copy_planes(planes: Planes) -> Planes:
    """A copy."""
    return Planes(planes.luma.copy(), planes.chroma.copy())


def full_range(planes: Planes) -> Planes:
    """The same picture with Y in 0..255 instead of 16..235, chroma about 128 as much wider."""
    luma = (planes.luma - np.float32(16.0)) * np.float32(FULL_OVER_LIMITED)
    chroma = (planes.chroma - np.float32(128.0)) * np.float32(255.0 / 224.0) + np.float32(128.0)
    return Planes(luma, chroma)


def dimmed(planes: Planes, gains: Array) -> Planes:
    """The same picture with the light of each row multiplied by gains (h,).

    By the power that the sRGB curve follows but for its darkest part: 1 / 2.2.
    """
    levels = np.asarray(gains ** (1.0 / 2.2), np.float32)[:, None]
    luma = (planes.luma - np.float32(16.0)) * levels + np.float32(16.0)
    pairs = 0.5 * (levels[0::2] + levels[1::2])
    chroma = (planes.chroma - np.float32(128.0)) * pairs + np.float32(128.0)
    return Planes(luma, chroma)


def copy_part(source: Planes, target: Planes, rows: slice, columns: slice) -> None:
    """Copy a rectangle on even boundaries from one picture to another."""
    target.luma[rows, columns] = source.luma[rows, columns]
    half_rows = slice(rows.start // 2, rows.stop // 2)
    half_columns = slice(columns.start // 2, columns.stop // 2)
    target.chroma[:, half_rows, half_columns] = source.chroma[:, half_rows, half_columns]


def tone_curve() -> Array32:
    """sRGB grey levels 0..255 over the square root of linear light 0..1; (_STEPS + 1,) float32."""
    light = np.linspace(0.0, 1.0, _STEPS + 1) ** 2
    curve: Array = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return (255.0 * curve).astype(np.float32)


def blur_weights(sigma_px: float) -> Array32:
    """Seven taps of a Gaussian, (7,) float32."""
    x = np.arange(-3, 4)
    weights = np.exp(-0.5 * (x / max(sigma_px, 1e-3)) ** 2)
    return (weights / weights.sum()).astype(np.float32)


@njit(cache=True, nogil=True, fastmath=True)
def _blur_row(columns: Ints, weights: Array32, light: Array32, out: Array32) -> None:
    """Blur one row (w, 3) along itself, between two columns; the three pixels at either end of the
    picture stay sharp.
    """
    width = light.shape[0]
    first, last = max(columns[0], 3), min(columns[1], width - 4)
    for x in range(columns[0], min(3, columns[1] + 1)):
        for i in range(3):
            out[x, i] = light[x, i]
    for x in range(max(width - 3, columns[0]), columns[1] + 1):
        for i in range(3):
            out[x, i] = light[x, i]
    for x in range(first, last + 1):
        for i in range(3):
            # Alike in `blur`, down the columns.
            out[x, i] = (
                weights[3] * light[x, i]
                + weights[2] * (light[x - 1, i] + light[x + 1, i])
                + weights[1] * (light[x - 2, i] + light[x + 2, i])
                + weights[0] * (light[x - 3, i] + light[x + 3, i])
            )


@njit(cache=True, nogil=True, fastmath=True)
def blur(columns: Ints, weights: Array32, light: Array32, scratch: Array32, out: Array32) -> None:
    """Separable blur of the light (h, w, 3) into out, between columns (h, 2) as in `to_yuv420`."""
    height = light.shape[0]
    wide = np.empty(2, np.int64)
    for y in range(height):
        # What this row's neighbours need of it.
        wide[0], wide[1] = light.shape[1], -1
        for v in range(max(0, y - 3), min(height, y + 4)):
            if columns[v, 1] >= columns[v, 0]:
                wide[0], wide[1] = min(wide[0], columns[v, 0]), max(wide[1], columns[v, 1])
        _blur_row(wide, weights, light[y], scratch[y])
    for y in range(height):
        inside = y >= 3 and y < height - 3
        for x in range(columns[y, 0], columns[y, 1] + 1):
            for i in range(3):
                if inside:
                    # Alike in `_blur_row`, along the row.
                    out[y, x, i] = (
                        weights[3] * scratch[y, x, i]
                        + weights[2] * (scratch[y - 1, x, i] + scratch[y + 1, x, i])
                        + weights[1] * (scratch[y - 2, x, i] + scratch[y + 2, x, i])
                        + weights[0] * (scratch[y - 3, x, i] + scratch[y + 3, x, i])
                    )
                else:
                    out[y, x, i] = scratch[y, x, i]


@njit(cache=True, nogil=True, inline="always")
def _tone(curve: Array32, light: float) -> float:
    """Grey level 0..255 of linear light."""
    return curve[int(math.sqrt(min(1.0, max(0.0, light))) * 1024.0 + 0.5)]


@njit(cache=True, nogil=True, fastmath=True)
def to_yuv420(columns: Ints, curve: Array32, light: Array32, planes: Planes) -> None:
    """Convert light (h, w, 3) to Y, U and V, unrounded, between columns (h, 2) of each row.

    The two rows of a pair have the same columns, from an even to an odd one; an empty row ends
    before it begins.
    """
    luma, chroma = planes.luma, planes.chroma
    for v in range(luma.shape[0] // 2):
        for w in range(columns[2 * v, 0] // 2, (columns[2 * v, 1] + 1) // 2):
            red, green, blue = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            for dy in range(2):
                for dx in range(2):
                    y, x = 2 * v + dy, 2 * w + dx
                    r = _tone(curve, light[y, x, 0])
                    g = _tone(curve, light[y, x, 1])
                    b = _tone(curve, light[y, x, 2])
                    luma[y, x] = (
                        np.float32(16.0)
                        + np.float32(0.257) * r
                        + np.float32(0.504) * g
                        + np.float32(0.098) * b
                    )
                    red, green, blue = red + r, green + g, blue + b
            chroma[0, v, w] = np.float32(128.0) + np.float32(0.25) * (
                np.float32(-0.148) * red - np.float32(0.291) * green + np.float32(0.439) * blue
            )
            chroma[1, v, w] = np.float32(128.0) + np.float32(0.25) * (
                np.float32(0.439) * red - np.float32(0.368) * green - np.float32(0.071) * blue
            )
