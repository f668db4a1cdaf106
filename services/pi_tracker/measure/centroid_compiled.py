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
from services.pi_tracker.image.planes import Planes
from services.pi_tracker.image.yuv_planes import Picture, planes_of
from services.pi_tracker.measure import centroid, centroid_sigma, paint_fraction
from services.pi_tracker.measure.blob_tiles import MARGIN
from services.pi_tracker.measure.centroid import Centroid
from services.pi_tracker.measure.grown_blob import NO_GROWTH, Growth, Limit, NearPaint

# Of a centroid; of a blob (compiled/tile.h).
_VALUES, BLOB_NUMBERS = 5, 8
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
        self._measure.argtypes = (void,) * 4 + (count, void, void, size, void, size, void)
        self._scratch_size = library.rhot_centroid_scratch
        self._scratch_size.restype = size
        self._scratch_size.argtypes = (count, count)
        # It must outlive its address.
        self._constants = _constants()
        self._constants_at = ctypes.addressof(self._constants)
        # Memory between calls. Whoever calls takes one out: threads never share it.
        self._kept: list[_Scratch] = []

    def __call__(
        self,
        picture: Picture,
        blobs: Sequence[Blob],
        noise: Noise,
        growth: Growth | None = None,
    ) -> list[Centroid]:
        """Measure blobs, grown first if growth is given; one result each, in their order.

        Raises ValueError of a blob outside the picture.
        """
        if not blobs:
            return []
        near = None if growth is None else growth.near
        limits = [NO_GROWTH] * len(blobs) if growth is None else growth.limits
        planes = picture.planes
        if planes is not None:
            return self._in_planes(planes, blobs, noise, near, limits)
        # What is not in planes is converted, for each blob as much as it needs.
        return [
            self._in_planes(_part(picture, blob, of), [blob], noise, near, [of])[0]
            for blob, of in zip(blobs, limits, strict=True)
        ]

    def _in_planes(
        self,
        planes: Planes,
        blobs: Sequence[Blob],
        noise: Noise,
        near: NearPaint | None,
        limits: Sequence[Limit],
    ) -> list[Centroid]:
        count, w, h = len(blobs), 0, 0
        numbers: list[int] = []
        for blob, (most, reach) in zip(blobs, limits, strict=True):
            x0, y0, x1, y1 = rect = blob.rect
            w, h = max(w, x1 - x0 + 2 * reach), max(h, y1 - y0 + 2 * reach)
            numbers += (*rect, blob.cells, blob.color + 1 if most else 0, most, reach)
        masks = b"".join([blob.mask.tobytes() for blob in blobs])
        scratch = self._scratch(self._scratch_size(w, h))
        out = (ctypes.c_double * (_VALUES * count))()
        wrong = self._measure(
            planes.in_c,
            self._constants_at,
            (ctypes.c_double * 2)(noise.luma, noise.chroma),
            None if near is None else ctypes.byref(near.in_c.of(planes)),
            count,
            struct.pack(f"{BLOB_NUMBERS * count}i", *numbers),
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


def _part(picture: Picture, blob: Blob, limit: Limit) -> Planes:
    """The cells that are looked at: a blob's tile, however it grows, within the picture."""
    (width, height), more = picture.size, MARGIN + limit.reach
    x0, y0, x1, y1 = blob.rect
    w, h = min(x1 - x0 + 2 * more, width), min(y1 - y0 + 2 * more, height)
    x, y = max(min(x0 - more, width - w), 0), max(min(y0 - more, height - h), 0)
    return planes_of(picture, (x, y, x + w, y + h))


centroids = None if loaded is None else CompiledCentroids(loaded)
