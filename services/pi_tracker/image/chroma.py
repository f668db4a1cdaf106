"""Colours of all cells of a picture: hue, saturation and value as the lookup table understands
them, and chroma free of shading. Pure.

A cell without light has no colour: its hue and saturation are those of noise, and whoever uses them
must ask for some value first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import picture

# Mostly float64; OpenCV's stubs do not say the type of what it returns.
Array = npt.NDArray[Any]
Mask = npt.NDArray[np.bool_]

# As in colors.py: R = L + 1.596 V', G = L - .392 U' - .813 V', B = L + 2.017 U', L = 1.164 (Y -
# 16).
_LUMA_GAIN = 255.0 / 219.0
_RED_V, _GREEN_U, _GREEN_V, _BLUE_U = 1.596027, -0.391762, -0.812968, 2.017232
# Below this luma (of 219) a cell counts as dark, so that its chroma is not divided by next to
# nothing.
_DARK = 8.0


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of 2x2 pixels: y is luma less 16, u and v are chroma less 128.

    All of one shape, (h, w) or (n,).
    """

    y: Array
    u: Array
    v: Array

    @property
    def shape(self) -> tuple[int, ...]:
        return self.y.shape

    @property
    def chroma(self) -> Array:
        """How strong the colour is, in grey levels of chroma."""
        return np.hypot(self.u, self.v)

    @property
    def tint(self) -> Array:
        """Chroma over luma, (..., 2): what shading leaves as it is."""
        scale = 1.0 / np.maximum(self.y, _DARK)
        return np.stack([self.u * scale, self.v * scale], axis=-1)

    def hsv(self) -> tuple[Array, Array, Array]:
        """OpenCV hue (0..180), saturation and value (0..255), not rounded and, as in the lookup
        table, not clipped to RGB.
        """
        red, green, blue = _RED_V * self.v, _GREEN_U * self.u + _GREEN_V * self.v, _BLUE_U * self.u
        top = np.maximum(np.maximum(red, green), blue)
        spread = top - np.minimum(np.minimum(red, green), blue)
        safe = np.maximum(spread, 1e-9)
        sector = np.where(
            top == red,
            (green - blue) / safe,
            np.where(top == green, 2.0 + (blue - red) / safe, 4.0 + (red - green) / safe),
        )
        value = np.maximum(_LUMA_GAIN * self.y + top, 1.0)
        return (
            np.where(spread > 0.0, (30.0 * sector) % 180.0, 0.0),
            np.minimum(255.0 * spread / value, 255.0),
            np.minimum(value, 255.0),
        )

    def __getitem__(self, where: Any) -> Cells:
        return Cells(self.y[where], self.u[where], self.v[where])


def cells_of(frame: Frame) -> Cells:
    """All cells of a frame, (h, w)."""
    image = picture(frame)
    width, height = image.size
    luma, chroma = image.cells((0, 0, width, height))
    return Cells(
        luma.astype(np.float64) - 16.0,
        chroma[..., 0].astype(np.float64) - 128.0,
        chroma[..., 1].astype(np.float64) - 128.0,
    )


def joined(parts: list[Cells]) -> Cells:
    """Cells of several pictures in one row, (n,)."""
    flat = [(part.y.ravel(), part.u.ravel(), part.v.ravel()) for part in parts]
    if not flat:
        return Cells(np.empty(0), np.empty(0), np.empty(0))
    y, u, v = (np.concatenate(rows) for rows in zip(*flat, strict=True))
    return Cells(y, u, v)


def hue_from(hue: Array, centre: float | Array) -> Array:
    """Signed distance of hues from a centre, -90..90."""
    return (hue - centre + 90.0) % 180.0 - 90.0


def hue_apart(hue: float, other: float) -> float:
    """Signed distance of one hue from another, -90..90."""
    return (hue - other + 90.0) % 180.0 - 90.0


def mean_hue(hue: Array, weight: Array) -> float:
    """Circular mean of OpenCV hues, 0..180; 0 of none."""
    angle = hue * (np.pi / 90.0)
    return float(
        np.arctan2(np.sum(weight * np.sin(angle)), np.sum(weight * np.cos(angle)))
        * (90.0 / np.pi)
        % 180.0
    )


def looks_like_skin(cells: Cells) -> Mask:
    """Cells whose chroma is that of skin of any complexion, after Chai and Ngan (IEEE Trans.

    CSVT 1999): Cb 77..127, Cr 133..173.
    """
    # Near grey everything is a little like everything: skin has at least this much chroma.
    return (
        (cells.u >= -51.0)
        & (cells.u <= -1.0)
        & (cells.v >= 5.0)
        & (cells.v <= 45.0)
        & (cells.chroma >= 9.0)
        & (cells.y >= 20.0)
    )
