"""Planes of luma and chroma in memory, for Python and for compiled code. Pure."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from services.pi_tracker.image.frame import Image

# (x0, y0, x1, y1) in cells, the end excluded.
Rect = tuple[int, int, int, int]

# Full range to limited range: 256 levels to 219 of luma about 16, and to 224 of chroma about 128.
_LEVELS = np.arange(256.0)
LIMITED_LUMA = np.round(16.0 + _LEVELS * (219.0 / 255.0)).astype(np.uint8)
LIMITED_CHROMA = np.round(128.0 + (_LEVELS - 128.0) * (224.0 / 255.0)).astype(np.uint8)
_LIMITED_IN_C = (LIMITED_LUMA.ctypes.data, LIMITED_CHROMA.ctypes.data)


# picture of compiled/picture.h: addresses of y, u, v and of both tables of levels; bytes of y and
# of u; bytes of a row of both; the window's left, top, right, bottom; the picture's width, height.
PICTURE_IN_C = struct.Struct("5P2q8i")


@dataclass(frozen=True, eq=False)
class Planes:
    """A picture, or a part of one: uint8, the last axis contiguous."""

    rect: Rect  # cells that it has
    size: tuple[int, int]  # cells of the picture (width, height)
    luma: Image  # (2h, 2w) of every pixel
    chroma: Image  # (2, h, w) u, v of every cell
    full_range: bool  # both are yet to be scaled, by LIMITED_LUMA and LIMITED_CHROMA

    @cached_property
    def in_c(self) -> bytes:
        """For compiled code; valid as long as these planes are."""
        luma, chroma = self.luma, self.chroma
        u = chroma.ctypes.data
        return PICTURE_IN_C.pack(
            luma.ctypes.data,
            u,
            u + chroma.strides[0],
            *(_LIMITED_IN_C if self.full_range else (0, 0)),
            luma.nbytes,
            chroma.nbytes // 2,
            luma.strides[0],
            chroma.strides[1],
            *self.rect,
            *self.size,
        )
