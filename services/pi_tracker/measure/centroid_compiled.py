"""The compiled form of centroid.py: the same numbers in one call for all blobs.

compiled/centroid.c has the formulas, and all constants come from here. Pure.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from services.pi_tracker.compiled.library import loaded
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.planes import Planes, Rect
from services.pi_tracker.image.yuv_planes import Picture, planes_of
from services.pi_tracker.measure import centroid, centroid_sigma, paint_fraction
from services.pi_tracker.measure.blob_tiles import MARGIN
from services.pi_tracker.measure.centroid import Centroid

_VALUES = 5  # of a centroid
# Floats of scratch that are kept from one frame to the next, 4 MB: what larger blobs need is freed.
_MOST_KEPT = 1 << 20
# What the function returns (compiled/centroid.c).
_WRONG = {-1: "no such picture", -2: "no such blob", -3: "masks too small", -4: "scratch too small"}


def _constants() -> ctypes.Structure:
    """constants of compiled/tile.h: each value under its name there, in the order there."""
    doubles = {
        "misfit_px": centroid_sigma.MISFIT_PX,
        "misfit_per_px": centroid_sigma.MISFIT_PER_PX,
        "sharp_band_px": centroid_sigma.SHARP_BAND_PX,
        "darkest": paint_fraction.DARKEST,
        "full_contrast": centroid.FULL_CONTRAST,
        "cut_sigma": centroid.CUT_SIGMA,
        "cut_quality": centroid.CUT_QUALITY,
        "disc_fill": centroid.DISC_FILL,
    }
    arrays = {
        "rgb": paint_fraction.RGB,
        "yuv_from_power": paint_fraction.YUV_FROM_POWER,
        "power_slopes": paint_fraction.POWER_SLOPES,
        "blur": paint_fraction.BLUR[1::-1],
    }
    floats = {
        "fallback": paint_fraction.FALLBACK_WEIGHT,
        "mask_only": centroid.MASK_ONLY_WEIGHT,
        "background_below": centroid.BACKGROUND_BELOW,
        "paint_above": centroid.PAINT_ABOVE[0],
        "paint_band": centroid.PAINT_BAND,
        "slope": centroid.SLOPE,
        "min_core_cells": centroid.MIN_CORE_CELLS,
    }
    fields: list[tuple[str, Any]] = [(name, ctypes.c_double) for name in doubles]
    fields += [(name, ctypes.c_float * values.size) for name, values in arrays.items()]
    fields += [(name, ctypes.c_float) for name in floats]
    kind = type("_Constants", (ctypes.Structure,), {"_fields_": fields})
    listed = {
        name: (ctypes.c_float * values.size)(*values.ravel().tolist())
        for name, values in arrays.items()
    }
    made: ctypes.Structure = kind(**doubles, **listed, **floats)
    return made


class _Scratch(NamedTuple):
    """Memory, and where it lies: to ask an array for its address costs a microsecond."""

    floats: Image
    address: int


class CompiledCentroids:
    """A library's centroids; called like centroid.centroids."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._measure = library.rhot_centroids
        self._measure.restype = ctypes.c_int32
        void, count, size = ctypes.c_void_p, ctypes.c_int32, ctypes.c_int64
        self._measure.argtypes = (void, void, void, count, void, void, size, void, size, void)
        self._scratch_size = library.rhot_centroid_scratch
        self._scratch_size.restype = size
        self._scratch_size.argtypes = (count, count)
        # It must outlive its address.
        self._constants = _constants()
        self._constants_at = ctypes.addressof(self._constants)
        # Memory between calls. Whoever calls takes one out: threads never share it.
        self._kept: list[_Scratch] = []

    def __call__(self, picture: Picture, blobs: Sequence[Blob], noise: Noise) -> list[Centroid]:
        """Measure blobs; one result each, in their order.

        Raises ValueError of a blob outside the picture.
        """
        if not blobs:
            return []
        planes = picture.planes
        if planes is not None:
            return self._in_planes(planes, blobs, noise)
        # What is not in planes is converted, for each blob as much as it needs.
        parts = [planes_of(picture, _tile(blob.rect, picture.size)) for blob in blobs]
        return [
            self._in_planes(part, [blob], noise)[0] for part, blob in zip(parts, blobs, strict=True)
        ]

    def _in_planes(self, planes: Planes, blobs: Sequence[Blob], noise: Noise) -> list[Centroid]:
        count = len(blobs)
        rects = [number for blob in blobs for number in (*blob.rect, blob.cells)]
        masks = b"".join([blob.mask.tobytes() for blob in blobs])
        w = max([blob.rect[2] - blob.rect[0] for blob in blobs])
        h = max([blob.rect[3] - blob.rect[1] for blob in blobs])
        scratch = self._scratch(self._scratch_size(w, h))
        out = (ctypes.c_double * (_VALUES * count))()
        wrong = self._measure(
            planes.in_c,
            self._constants_at,
            (ctypes.c_double * 2)(noise.luma, noise.chroma),
            count,
            struct.pack(f"{5 * count}i", *rects),
            masks,
            len(masks),
            scratch.address,
            scratch.floats.size,
            out,
        )
        if scratch.floats.size <= _MOST_KEPT:
            self._kept.append(scratch)
        if wrong:
            raise ValueError(
                f"{_WRONG.get(wrong, wrong)}: blobs at {[blob.rect for blob in blobs]} of a "
                f"picture of {planes.size} cells, planes of {planes.rect}"
            )
        values = iter(out[:])
        return [
            Centroid(*five) if five[2] >= 1.0 else centroid.lost(blob)
            for blob, five in zip(blobs, zip(*[values] * _VALUES, strict=True), strict=True)
        ]

    def _scratch(self, count: int) -> _Scratch:
        """Memory for so many floats."""
        kept = self._kept.pop() if self._kept else None
        if kept is not None and kept.floats.size >= count:
            return kept
        floats = np.empty(max(count, 0), np.float32)
        return _Scratch(floats, floats.ctypes.data)


def _tile(rect: Rect, size: tuple[int, int]) -> Rect:
    """The cells that are looked at: a blob's rectangle and MARGIN more, within the picture."""
    (x0, y0, x1, y1), (width, height) = rect, size
    w, h = min(x1 - x0 + 2 * MARGIN, width), min(y1 - y0 + 2 * MARGIN, height)
    x, y = max(min(x0 - MARGIN, width - w), 0), max(min(y0 - MARGIN, height - h), 0)
    return x, y, x + w, y + h


centroids = None if loaded is None else CompiledCentroids(loaded)
