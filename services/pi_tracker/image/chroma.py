"""Colours of cells (2x2 pixels): HSV as the lookup tables define it, and chromaticity. Pure.

Chromaticity is chroma over luma: shading scales both alike, so it depends on the paint and the
light's colour only. A cell without light has no colour. Its hue and saturation are those of noise:
ask for some value first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.hue import LUMA_GAIN, Array, hue_of_chroma
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture, picture

Mask = npt.NDArray[np.bool_]

# Below this luma (of 219) a cell counts as dark: chroma is not divided by next to nothing.
DARK_LUMA = 8.0


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of 2x2 pixels: y = Y - 16, u = U - 128, v = V - 128.

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
        """Magnitude of the chroma, grey levels."""
        return np.hypot(self.u, self.v)

    @property
    def chromaticity(self) -> Array:
        """Chroma over luma, (..., 2), which shading does not change."""
        scale = 1.0 / np.maximum(self.y, DARK_LUMA)
        return np.stack([self.u * scale, self.v * scale], axis=-1)

    def hsv(self) -> tuple[Array, Array, Array]:
        """OpenCV hue (0..180), saturation and value (0..255).

        Not rounded, and, as in the lookup tables, RGB is not clipped.
        """
        hue, spread, top = hue_of_chroma(self.u, self.v)
        value = np.maximum(LUMA_GAIN * self.y + top, 1.0)
        return (
            hue,
            np.minimum(255.0 * spread / value, 255.0),
            np.minimum(value, 255.0),
        )

    def __getitem__(self, where: Any) -> Cells:
        return Cells(self.y[where], self.u[where], self.v[where])


def cells_of(frame: Frame) -> Cells:
    """All cells of a frame, (h, w)."""
    image = picture(frame)
    return cells_in(image, (0, 0, *image.size))


def cells_in(image: Picture, rect: Rect) -> Cells:
    """Cells of a rectangle, (h, w)."""
    luma, chroma = image.cells(rect)
    return Cells(
        luma.astype(np.float64) - 16.0,
        chroma[..., 0].astype(np.float64) - 128.0,
        chroma[..., 1].astype(np.float64) - 128.0,
    )


def concatenate(parts: list[Cells]) -> Cells:
    """Cells of several pictures as one list, (n,)."""
    flat = [(part.y.ravel(), part.u.ravel(), part.v.ravel()) for part in parts]
    if not flat:
        return Cells(np.empty(0), np.empty(0), np.empty(0))
    y, u, v = (np.concatenate(planes) for planes in zip(*flat, strict=True))
    return Cells(y, u, v)


def skin_mask(cells: Cells) -> Mask:
    """Which cells have the chroma of skin of any complexion: Cb 77..127, Cr 133..173.

    Chai and Ngan, IEEE Trans. CSVT 1999.
    """
    # Near grey every colour is a little like skin: skin has at least this much chroma. What is
    # dark is near grey, too, and magenta in shade would be skin; no skin is so far towards blue.
    return (
        (cells.u >= -51.0)
        & (cells.u <= np.minimum(-1.0, -0.15 * cells.v))
        & (cells.v >= 5.0)
        & (cells.v <= 45.0)
        & (cells.chroma >= 9.0)
        & (cells.y >= 20.0)
    )
