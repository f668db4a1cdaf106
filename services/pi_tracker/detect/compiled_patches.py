"""The compiled form of BlobDetector.detect, for what it meets as a rule; pure.

compiled/patches.c does it: classes of cells straight from a picture's planes, mask filters, and
patches of one colour each.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.blob import Blob, make_blob
from services.pi_tracker.image.compiled_colors import CompiledColors
from services.pi_tracker.image.planes import Planes, Rect

# What the function returns (compiled/patches.c).
_WRONG = {-1: "no such picture", -2: "no such rectangle", -3: "no room for the classes"}
_FOR_PYTHON = -4
# Numbers of a patch: its rectangle, class and cells.
_NUMBERS = 6
_INT = ctypes.c_int32
# Of memory for each cell, of a multiple of 8 of them.
_BYTES, _PADDING = 7, 7


class Patches(NamedTuple):
    """What a rectangle holds."""

    cells: int  # of the part of it that has colours, and around it
    blobs: list[Blob]


class CompiledPatches:
    """A library's patches, by the layers of one ColorTable.

    margin, rounds (of erosion, and of dilation), min_cells, most: as BlobDetector has them. Belongs
    to one thread: it owns the memory it works in.
    """

    def __init__(
        self,
        library: ctypes.CDLL,
        layers: Sequence[npt.NDArray[np.uint32]],
        *,
        margin: int,
        rounds: int,
        min_cells: int,
        most: int,
    ) -> None:
        self._find = library.rhot_patches
        self._find.restype = _INT
        void, size = ctypes.c_void_p, ctypes.c_int64
        self._find.argtypes = (void, void, void, void, void, size, void, void)
        self._colors = CompiledColors(layers)
        self._options = (_INT * 4)(margin, rounds, min_cells, most)
        self._part, self._out = (_INT * 4)(), (_INT * (_NUMBERS * most))()
        self._memory, self._memory_at = np.empty(0, np.uint8), 0

    def __call__(self, planes: Planes, rect: Rect) -> Patches | None:
        """The blobs of a rectangle, in no order; None where Python has to look.

        Raises ValueError of a rectangle that is not within the planes.
        """
        size = _BYTES * (planes.size[0] * planes.size[1] + _PADDING)
        if self._memory.size < size:
            self._memory = np.empty(size, np.uint8)
            # To ask an array for its address costs a microsecond.
            self._memory_at = self._memory.ctypes.data
        colors = self._colors.of(planes)
        count = self._find(
            planes.in_c,
            (_INT * 4)(*rect),
            ctypes.byref(colors),
            self._options,
            self._memory_at,
            self._memory.size,
            self._part,
            self._out,
        )
        if count == _FOR_PYTHON:
            return None
        if count < 0:
            raise ValueError(
                f"{_WRONG.get(count, count)}: {rect} of planes of {planes.rect} in a picture of "
                f"{planes.size} cells"
            )
        x0, y0, x1, y1 = self._part
        # Blobs keep parts of it.
        found = self._memory[: (x1 - x0) * (y1 - y0)].reshape(y1 - y0, x1 - x0).copy()
        left, top = rect[0] + x0, rect[1] + y0
        numbers = iter(self._out[: _NUMBERS * count])
        blobs = [
            make_blob(k - 1, (left + u0, top + v0, left + u1, top + v1), found[v0:v1, u0:u1], own)
            for u0, v0, u1, v1, k, own in zip(*[numbers] * _NUMBERS, strict=True)
        ]
        return Patches(found.size, blobs)
