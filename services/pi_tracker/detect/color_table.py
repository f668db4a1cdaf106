"""HSV ranges, as people edit them, compiled to chroma lookup tables with luma bounds.

At a fixed chroma (u, v) the colours of all lumas differ by grey only, so hue and the spread max -
min of R, G, B are fixed, and the bounds on saturation = spread / value and on value turn into one
interval of luma. One table of 65536 entries thus holds the exact HSV test of every colour: the
class, and the lowest and highest luma. A Pi's YUV420 planes are classified without ever being
converted.

Where ranges overlap, a pixel belongs to the colour whose hue is nearer; where two colours share a
chroma but not a luma (dark and light blue), the second goes to another layer. Pure; a colour that
is missing in the file is a CalibrationError at start.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.image.frame import Image

Bytes = npt.NDArray[np.uint8]
Array = npt.NDArray[np.float64]

# BT.601 with Y in 16..235: R = L + 1.596 V', G = L - .392 U' - .813 V', B = L + 2.017 U', L = 1.164
# (Y - 16).
_LUMA_GAIN = 255.0 / 219.0
_RED_V, _GREEN_U, _GREEN_V, _BLUE_U = 1.596027, -0.391762, -0.812968, 2.017232


class ColorTable:
    """Compiled colours: class k + 1 is names[k]; layers are (65536,) uint32 of the bytes class, low
    luma, high luma, 0.

    Belongs to one thread: it owns the buffers it works in.
    """

    def __init__(self, names: tuple[str, ...], layers: tuple[npt.NDArray[np.uint32], ...]) -> None:
        self.names = names
        self.layers = layers
        # OpenCV looks up signed integers of this size only.
        self._packed = [_lookup(layer.view(np.int32)) for layer in layers]
        self._ceiling = _lookup(
            np.max([layer.view(np.uint8).reshape(-1, 4)[:, 2] for layer in layers], axis=0)
        )
        self._memory = np.empty(0, np.uint8)
        self._lay_out((0, 0))

    def classify(self, luma: Image, chroma: Image) -> Image:
        """The class of every cell, 0 for none; luma (h, w), chroma u, v (h, w, 2) -> (h, w)."""
        return cv2.bitwise_and(*self._looked_up(luma, _index(chroma)))

    def likely(self, luma: Image, chroma: Image) -> Image:
        """255 where there may be a colour, 0 where there is none; (h, w).

        Half the work of classifying: darkness is not asked for.
        """
        return cv2.compare(luma, self._ceiling(_index(chroma), None), cv2.CMP_LE)

    def patch(self, luma: Image, chroma: Image, margin: int = 0) -> tuple[int, int, Image, Image]:
        """The smallest rectangle with all cells that have a colour, and `margin` more: its left and
        top, the class of every cell, and 255 where there is one, both (h, w) of the rectangle, the
        caller's own. Without any colour the rectangle is empty.
        """
        classes, mask = self._looked_up(luma, _index(chroma))
        x, y, w, h = cv2.boundingRect(mask)
        margin = margin if w else 0
        left, top = max(x - margin, 0), max(y - margin, 0)
        part = (slice(top, y + h + margin), slice(left, x + w + margin))
        kept = mask[part].copy()
        return left, top, cv2.bitwise_and(classes[part], kept) if w else kept, kept

    def _looked_up(self, luma: Image, index: Image) -> tuple[Image, Image]:
        """The class by chroma of every cell, and 255 where luma agrees.

        Good until the next call.
        """
        if luma.shape != self._planes[0].shape:
            self._lay_out(luma.shape)
        classes, low, high, mask = self._planes
        labels, seen = classes, mask
        for number, packed in enumerate(self._packed):
            packed(index, self._found)
            cv2.split(self._entries, self._planes)
            cv2.inRange(luma, low, high, mask)
            if len(self.layers) > 1:
                found = cv2.bitwise_and(classes, mask)
                # Layers never claim the same cell: they share chromas, not lumas.
                labels, seen = (
                    (cv2.max(labels, found), cv2.max(seen, mask))
                    if number
                    else (found, mask.copy())
                )
        return labels, seen

    def _lay_out(self, shape: tuple[int, ...]) -> None:
        """Images of a shape in memory that is kept: fresh memory would cost four times what is done
        in it.
        """
        size = math.prod(shape)
        if self._memory.size < 8 * size:
            self._memory = np.empty(8 * size, np.uint8)
        entries = self._memory[: 4 * size]
        self._found, self._entries = (
            entries.view(np.int32).reshape(shape),
            entries.reshape(*shape, 4),
        )
        self._planes = list(self._memory[4 * size : 8 * size].reshape(4, *shape))


def _index(chroma: Image) -> Image:
    return chroma.view(np.uint16)[:, :, 0]


def _lookup(table: npt.NDArray[np.integer[Any]]) -> Callable[[Image, Image | None], Image]:
    """A table (65536,) to apply to uint16, into an image if there is one: by OpenCV where it can
    (5; twice as fast), else by numpy.
    """
    try:
        cv2.LUT(np.zeros((1, 1), np.uint16), table[None])
    except cv2.error:
        return lambda index, into: table.take(index, out=into, mode="wrap")
    return lambda index, into: cv2.LUT(index, table[None], into)


def compile_colors(
    colors: Colors, wanted: Sequence[str], path: Path | str = "colors.json"
) -> ColorTable:
    """The table of the wanted colours.

    Raises CalibrationError naming the colour, the file and the colours there are. path is for that
    message only.
    """
    missing = [name for name in wanted if name not in colors.colors]
    if missing:
        raise CalibrationError(
            f"{path}: colour {missing[0]!r} of rig.toml's markers is not in it; it has {', '.join(sorted(colors.colors)) or 'none'}. "
            f"Add it with `rhot calibrate colors`, or correct rig.toml"
        )
    hue, spread, top = _chroma_geometry()
    layers = [_Layer()]
    for number, name in enumerate(wanted, start=1):
        low, high = _luma_interval(colors.colors[name], hue, spread, top)
        distance = _hue_distance(colors.colors[name], hue)
        rest = low <= high
        for layer in layers:
            rest = layer.claim(number, rest, low, high, distance)
        if rest.any():
            layers.append(_Layer())
            layers[-1].claim(number, rest, low, high, distance)
    return ColorTable(tuple(wanted), tuple(layer.packed() for layer in layers))


class _Layer:
    """One table while it is being filled; all arrays (65536,)."""

    def __init__(self) -> None:
        self.owner = np.zeros(65536, np.uint8)
        self.low = np.full(65536, 255, np.int64)
        self.high = np.zeros(65536, np.int64)
        self.distance = np.full(65536, np.inf)

    def claim(
        self, number: int, mine: npt.NDArray[np.bool_], low: Array, high: Array, distance: Array
    ) -> npt.NDArray[np.bool_]:
        """Take what is free, or nearer in hue than its owner.

        Returns what must go to another layer.
        """
        apart = (low > self.high) | (high < self.low)
        taken = self.owner != 0
        win = mine & (~taken | (~apart & (distance < self.distance)))
        self.owner[win] = number
        self.low[win] = low[win].astype(np.int64)
        self.high[win] = high[win].astype(np.int64)
        self.distance[win] = distance[win]
        return mine & taken & apart & ~win

    def packed(self) -> npt.NDArray[np.uint32]:
        table = np.zeros((65536, 4), np.uint8)
        table[:, 0], table[:, 1], table[:, 2] = self.owner, self.low, self.high
        return table.view(np.uint32).reshape(65536)


def _chroma_geometry() -> tuple[Array, Array, Array]:
    """OpenCV hue (0..180), max - min of R, G, B, and max - L of every chroma u + 256 v.

    Each (65536,).
    """
    v, u = np.divmod(np.arange(65536), 256)
    U, V = u - 128.0, v - 128.0
    red, green, blue = _RED_V * V, _GREEN_U * U + _GREEN_V * V, _BLUE_U * U
    top = np.maximum(np.maximum(red, green), blue)
    spread = top - np.minimum(np.minimum(red, green), blue)
    safe = np.maximum(spread, 1e-9)
    sector = np.where(
        top == red,
        (green - blue) / safe,
        np.where(top == green, 2.0 + (blue - red) / safe, 4.0 + (red - green) / safe),
    )
    return np.where(spread > 0.0, (30.0 * sector) % 180.0, 0.0), spread, top


def _luma_interval(span: ColorRange, hue: Array, spread: Array, top: Array) -> tuple[Array, Array]:
    """Lowest and highest luma at which a chroma lies in the range (low > high: at none); each
    (65536,).

    OpenCV rounds hue, saturation and value, hence the halves; bounds of 0 and 255 do not bound, as
    RGB saturates there.
    """
    (h0, s0, v0), (h1, s1, v1) = span.hsv_low, span.hsv_high
    value_low = np.full_like(hue, v0 - 0.5) if v0 > 0 else np.full_like(hue, -np.inf)
    value_high = np.full_like(hue, v1 + 0.5) if v1 < 255 else np.full_like(hue, np.inf)
    if s0 > 0:
        value_high = np.minimum(value_high, 255.0 * spread / (s0 - 0.5))
    if s1 < 255:
        value_low = np.maximum(value_low, 255.0 * spread / (s1 + 0.5))
    low = np.ceil(np.maximum((value_low - top) / _LUMA_GAIN + 16.0, 0.0))
    high = np.floor(np.minimum((value_high - top) / _LUMA_GAIN + 16.0, 255.0))
    inside = _in_hue(hue, h0, h1)
    # A range empty in itself (low above high) stays empty: clipping must not turn it into one of a
    # single luma.
    return np.where(inside, np.minimum(low, 256.0), 256.0), np.where(
        inside, np.maximum(high, -1.0), -1.0
    )


def _in_hue(hue: Array, low: int, high: int) -> npt.NDArray[np.bool_]:
    if low <= high:
        # A hue just below 180 rounds to 180, which OpenCV writes as 0.
        return ((hue >= low - 0.5) & (hue < high + 0.5)) | ((low == 0) & (hue >= 179.5))
    return (hue >= low - 0.5) | (hue < high + 0.5)


def _hue_distance(span: ColorRange, hue: Array) -> Array:
    """How far a chroma lies from the middle of the range, in half widths of it; (65536,)."""
    low, high = span.hsv_low[0], span.hsv_high[0]
    width = (high - low) % 180
    middle = low + width / 2.0
    return np.abs((hue - middle + 90.0) % 180.0 - 90.0) / (width / 2.0 + 0.5)


def hsv_mask(hsv: Image, span: ColorRange) -> Image:
    """The seed's test on an HSV image (h, w, 3): 255 inside the range.

    Low hue above high wraps through red.
    """
    low, high = np.array(span.hsv_low, np.uint8), np.array(span.hsv_high, np.uint8)
    if span.hsv_low[0] <= span.hsv_high[0]:
        return cv2.inRange(hsv, low, high)
    above = cv2.inRange(hsv, low, np.array([179, *span.hsv_high[1:]], np.uint8))
    below = cv2.inRange(hsv, np.array([0, *span.hsv_low[1:]], np.uint8), high)
    return cv2.bitwise_or(above, below)
