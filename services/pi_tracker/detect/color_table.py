"""Colour classification of YUV420 cells by lookup tables, compiled from HSV ranges.

A range holds an interval of luma at each chroma (hsv_range.py). One table of 65536 entries thus
holds the exact HSV test of every colour: the class, and the lowest and highest luma. A Pi's YUV420
planes are classified without ever being converted.

Where ranges overlap, a pixel belongs to the colour whose hue is nearer. Where two colours share a
chroma but not a luma (dark and light blue), the second goes to another layer. Pure; a colour that
is missing in the file is a CalibrationError at start.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.files.calibration import Colors
from services.pi_tracker.detect.hsv_range import hue_distance, hue_of_all_chroma, luma_interval
from services.pi_tracker.image.frame import Image

Array = npt.NDArray[np.float64]


class ClassPatch(NamedTuple):
    """The smallest rectangle with all cells that have a colour, and a margin around it."""

    left: int
    top: int
    classes: Image  # (h, w) of the rectangle, 0 for none
    mask: Image  # (h, w) 255 where there is a class


class ColorTable:
    """Compiled colours: class k + 1 is names[k].

    layers are (65536,) uint32, each of the bytes class, low luma, high luma, 0. Belongs to one
    thread: it owns the buffers it works in.
    """

    def __init__(self, names: tuple[str, ...], layers: tuple[npt.NDArray[np.uint32], ...]) -> None:
        self.names = names
        self.layers = layers
        # OpenCV looks up signed integers of this size only.
        self._lookups = [_lookup(layer.view(np.int32)) for layer in layers]
        self._highest_luma = _lookup(
            np.max([layer.view(np.uint8).reshape(-1, 4)[:, 2] for layer in layers], axis=0)
        )
        self._memory = np.empty(0, np.uint8)
        self._allocate((0, 0))

    def classify(self, luma: Image, chroma: Image) -> Image:
        """The class of every cell, 0 for none; luma (h, w), chroma u, v (h, w, 2) -> (h, w)."""
        return cv2.bitwise_and(*self._look_up(luma, _index(chroma)))

    def candidates(self, luma: Image, chroma: Image) -> Image:
        """255 where a cell may have a class, 0 where it has none; (h, w).

        Half the work of classifying: lower bounds of luma are not tested.
        """
        return cv2.compare(luma, self._highest_luma(_index(chroma), None), cv2.CMP_LE)

    def classify_cropped(self, luma: Image, chroma: Image, margin: int = 0) -> ClassPatch:
        """The classes, cropped to the cells that have one and `margin` more around them.

        The arrays are the caller's own. Without any colour the rectangle is empty.
        """
        classes, mask = self._look_up(luma, _index(chroma))
        x, y, w, h = cv2.boundingRect(mask)
        margin = margin if w else 0
        left, top = max(x - margin, 0), max(y - margin, 0)
        part = (slice(top, y + h + margin), slice(left, x + w + margin))
        own_mask = mask[part].copy()
        own_classes = cv2.bitwise_and(classes[part], own_mask) if w else own_mask
        return ClassPatch(left, top, own_classes, own_mask)

    def _look_up(self, luma: Image, index: Image) -> tuple[Image, Image]:
        """The class by chroma of every cell, and 255 where luma agrees.

        Valid until the next call.
        """
        if luma.shape != self._planes[0].shape:
            self._allocate(luma.shape)
        classes, low, high, mask = self._planes
        all_classes, all_masks = classes, mask
        for number, lookup in enumerate(self._lookups):
            lookup(index, self._packed_entries)
            cv2.split(self._entries, self._planes)
            cv2.inRange(luma, low, high, mask)
            if len(self.layers) == 1:
                continue
            found = cv2.bitwise_and(classes, mask)
            # Layers never claim the same cell: they share chromas, not lumas.
            if number == 0:
                all_classes, all_masks = found, mask.copy()
            else:
                all_classes, all_masks = cv2.max(all_classes, found), cv2.max(all_masks, mask)
        return all_classes, all_masks

    def _allocate(self, shape: tuple[int, ...]) -> None:
        """Images of a shape in memory that is kept.

        Fresh memory would cost four times the work done in it.
        """
        size = math.prod(shape)
        if self._memory.size < 8 * size:
            self._memory = np.empty(8 * size, np.uint8)
        entries = self._memory[: 4 * size]
        self._packed_entries = entries.view(np.int32).reshape(shape)
        self._entries = entries.reshape(*shape, 4)
        self._planes = list(self._memory[4 * size : 8 * size].reshape(4, *shape))


def _index(chroma: Image) -> Image:
    return chroma.view(np.uint16)[:, :, 0]


def _lookup(table: npt.NDArray[np.integer[Any]]) -> Callable[[Image, Image | None], Image]:
    """A function that applies a table (65536,) to uint16, into an image if there is one.

    By OpenCV where it can (version 5; twice as fast), else by numpy.
    """
    try:
        cv2.LUT(np.zeros((1, 1), np.uint16), table[None])
    except cv2.error:
        return lambda index, into: table.take(index, out=into, mode="wrap")
    return lambda index, into: cv2.LUT(index, table[None], into)


def compile_colors(
    colors: Colors, color_names: Sequence[str], path: Path | str = "colors.json"
) -> ColorTable:
    """The table of the named colours.

    Raises CalibrationError naming the colour, the file and the colours there are. path is for that
    message only.
    """
    # Alike in colors/validate.py: this message is for who starts a tracker, that for who sends
    # colours.
    missing = [name for name in color_names if name not in colors.colors]
    if missing:
        raise CalibrationError(
            f"{path}: colour {missing[0]!r} of rig.toml's markers is not in it; it has "
            f"{', '.join(sorted(colors.colors)) or 'none'}. "
            f"Add it with `rhot calibrate colors`, or correct rig.toml"
        )
    chroma = hue_of_all_chroma()
    layers = [_Layer()]
    for number, name in enumerate(color_names, start=1):
        low, high = luma_interval(colors.colors[name], chroma)
        distance = hue_distance(colors.colors[name], chroma.hue)
        unclaimed = low <= high
        for layer in layers:
            unclaimed = layer.claim(number, unclaimed, low, high, distance)
        if unclaimed.any():
            layers.append(_Layer())
            layers[-1].claim(number, unclaimed, low, high, distance)
    return ColorTable(tuple(color_names), tuple(layer.packed() for layer in layers))


class _Layer:
    """One table while it is being filled; all arrays (65536,)."""

    def __init__(self) -> None:
        self.owner = np.zeros(65536, np.uint8)
        self.low = np.full(65536, 255, np.int64)
        self.high = np.zeros(65536, np.int64)
        self.distance = np.full(65536, np.inf)

    def claim(
        self, number: int, claimed: npt.NDArray[np.bool_], low: Array, high: Array, distance: Array
    ) -> npt.NDArray[np.bool_]:
        """Take what is free, or nearer in hue than its owner.

        Returns what must go to another layer.
        """
        disjoint = (low > self.high) | (high < self.low)
        taken = self.owner != 0
        won = claimed & (~taken | (~disjoint & (distance < self.distance)))
        self.owner[won] = number
        self.low[won] = low[won].astype(np.int64)
        self.high[won] = high[won].astype(np.int64)
        self.distance[won] = distance[won]
        return claimed & taken & disjoint & ~won

    def packed(self) -> npt.NDArray[np.uint32]:
        table = np.zeros((65536, 4), np.uint8)
        table[:, 0], table[:, 1], table[:, 2] = self.owner, self.low, self.high
        return table.view(np.uint32).reshape(65536)
