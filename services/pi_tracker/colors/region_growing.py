"""Region growing by chromaticity: the cells of one paint, connected to where it was pointed at.

A patch shades from light to dark and bleeds into skin at its rim; its chromaticity (chroma over
luma) stays, and that is what it is grown by. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from services.pi_tracker.colors.pointer import MIN_CELLS
from services.pi_tracker.image.chroma import Cells, Mask
from services.pi_tracker.image.hue import Array
from services.pi_tracker.image.planes import Rect

# Chroma of grey walls in real video is 2 +- 2 grey levels (99 %: 5); a pastel ball in poor light
# has 12.
MIN_CHROMA = 6.0
# Cells about a click in which its colour is read: a person hits the middle of a finger tip to
# within two of them.
_CLICK_REACH = 2
# A patch's chromaticity varies this much across its direction and along it: shading and lamps of
# different colour turn it little, highlights pale it more. Twice the quantiles measured on a pastel
# ball.
_MAX_ACROSS, _MIN_ALONG, _MAX_ALONG = 0.30, 0.40, 2.2
# Besides, noise and video compression move chroma by this many grey levels.
_CHROMA_NOISE = 2.5
# Bins of chromaticity, for the histograms inside a box and around it: directions (5 degrees), and
# half octaves of its strength, from that of a wall that is not quite grey.
_DIRECTIONS, _STRENGTHS, _WEAKEST = 72, 12, 0.03
# A colour that is so many times as frequent in the box as around it belongs to the object.
_OBJECT_RATIO = 3.0


class RegionStart(NamedTuple):
    """The cells a region grows from, and their chromaticity (2,); None if none is coloured."""

    chromaticity: Array | None
    cells: Mask  # (h, w) of the window


def start_at_click(window: Cells, x: int, y: int) -> RegionStart:
    """The coloured cells about cell (x, y) of a window (h, w)."""
    near = np.zeros(window.shape, bool)
    near[_around(y, _CLICK_REACH), _around(x, _CLICK_REACH)] = True
    coloured = near & (window.chroma >= MIN_CHROMA)
    middle = np.zeros(window.shape, bool)
    middle[_around(y, 1), _around(x, 1)] = True
    # The very middle, unless a highlight sits there.
    in_middle = coloured & middle
    return _start(window, in_middle if np.count_nonzero(in_middle) >= MIN_CELLS else coloured)


def _around(index: int, reach: int) -> slice:
    return slice(max(index - reach, 0), index + reach + 1)


def start_in_box(cells: Cells, rect: Rect) -> RegionStart:
    """The box's cells of its commonest colour, of those that are rarer around the box.

    Cells near the middle have more weight, as people draw boxes around objects. cells is the whole
    picture (h, w).
    """
    x0, y0, x1, y1 = rect
    height, width = cells.shape
    w, h = x1 - x0, y1 - y0
    ring = np.zeros(cells.shape, bool)
    ring[max(y0 - h, 0) : min(y1 + h, height), max(x0 - w, 0) : min(x1 + w, width)] = True
    ring[y0:y1, x0:x1] = False
    box, outside = cells[y0:y1, x0:x1], cells[ring]
    rows, columns = np.mgrid[:h, :w]
    nearness = np.exp(
        -4.0 * (((columns + 0.5) / w - 0.5) ** 2 + ((rows + 0.5) / h - 0.5) ** 2) / 0.25
    )
    weight = np.where(box.chroma >= MIN_CHROMA, nearness, 0.0)
    inside = _histogram(box, weight / max(float(nearness.sum()), 1e-9))
    around = _histogram(outside, (outside.chroma >= MIN_CHROMA) / max(float(outside.y.size), 1.0))
    of_object = np.where(inside > _OBJECT_RATIO * around, inside, 0.0)
    peak = np.unravel_index(int(np.argmax(of_object)), of_object.shape)
    if of_object[peak] <= 0.0:
        return RegionStart(None, np.zeros((h, w), bool))
    direction, strength = _bins(box)
    apart = np.abs(direction - peak[0])
    at_peak = (np.minimum(apart, _DIRECTIONS - apart) <= 1) & (np.abs(strength - peak[1]) <= 1)
    return _start(box, at_peak & (weight > 0.0))


def _start(window: Cells, starts: Mask) -> RegionStart:
    if np.count_nonzero(starts) < MIN_CELLS:
        return RegionStart(None, starts)
    return RegionStart(np.median(window[starts].chromaticity, axis=0), starts)


def _bins(cells: Cells) -> tuple[Array, Array]:
    """Bins of chromaticity: its direction and, in half octaves, its strength."""
    chromaticity = cells.chromaticity
    angle = np.arctan2(chromaticity[..., 1], chromaticity[..., 0])
    direction = np.floor(angle * (_DIRECTIONS / (2.0 * np.pi))).astype(np.int64) % _DIRECTIONS
    magnitude = np.hypot(chromaticity[..., 0], chromaticity[..., 1])
    half_octaves = np.floor(2.0 * np.log2(np.maximum(magnitude, 1e-6) / _WEAKEST))
    return direction, np.clip(half_octaves, 0, _STRENGTHS - 1).astype(np.int64)


def _histogram(cells: Cells, weight: Array) -> Array:
    """Sums of weights in bins, smoothed over neighbours; (_DIRECTIONS, _STRENGTHS)."""
    direction, strength = _bins(cells)
    bins = (direction * _STRENGTHS + strength).ravel()
    counts = np.bincount(bins, weight.ravel(), _DIRECTIONS * _STRENGTHS)
    histogram = counts.reshape(_DIRECTIONS, _STRENGTHS)
    wrapped = np.concatenate([histogram[-1:], histogram, histogram[:1]])
    return cv2.blur(wrapped, (3, 3), borderType=cv2.BORDER_CONSTANT)[1:-1]


def grow_region(window: Cells, chromaticity: Array, starts: Mask, tolerance: float = 1.0) -> Mask:
    """Cells (h, w) of like chromaticity (2,), connected to one another and to the starts.

    Of several regions the one that holds most of the starts. tolerance: how far chromaticity may
    be off, as share of what paint's varies by.
    """
    strength = float(np.hypot(*chromaticity))
    if strength <= 0.0:
        return np.zeros(window.shape, bool)
    across = chromaticity[::-1] * np.array([-1.0, 1.0]) / strength
    along = chromaticity / strength
    luma = np.maximum(window.y, 1.0)
    chroma_across = np.abs(window.u * across[0] + window.v * across[1])
    chroma_along = window.u * along[0] + window.v * along[1]
    expected = strength * luma
    across_most = _MAX_ACROSS * np.maximum(chroma_along, 0.0) + _CHROMA_NOISE
    least = (1.0 - tolerance * (1.0 - _MIN_ALONG)) * expected - tolerance * _CHROMA_NOISE
    most = (1.0 + tolerance * (_MAX_ALONG - 1.0)) * expected + tolerance * _CHROMA_NOISE
    like = (
        (chroma_across <= tolerance * across_most)
        & (chroma_along >= least)
        & (chroma_along <= most)
        & (window.chroma >= 0.5 * MIN_CHROMA)
    )
    _, labels = cv2.connectedComponents(like.astype(np.uint8), connectivity=4)
    hit, counts = np.unique(labels[starts & like], return_counts=True)
    return labels == hit[np.argmax(counts)] if len(hit) else np.zeros(window.shape, bool)


def touches_border(region: Mask, rect: Rect, cells: Cells) -> bool:
    """Whether a region grown in a window `rect` ends at the window rather than by itself.

    The border of the picture (cells) may cut it.
    """
    height, width = cells.shape
    x0, y0, x1, y1 = rect
    return bool(
        (y0 > 0 and region[0].any())
        or (x0 > 0 and region[:, 0].any())
        or (y1 < height and region[-1].any())
        or (x1 < width and region[:, -1].any())
    )
