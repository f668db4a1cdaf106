"""Pieces of one marker, which a shadow's edge or a highlight cuts in two, joined again. Pure.

Between lit and shaded paint lies a line of cells of another hue or of too little saturation. Mask
filters widen it, and each side is a blob of its own. Alone, the smaller one may be nearer to where
the marker must be, or more consistent with the other markers, and its centre is pixels off.
"""

from __future__ import annotations

import cv2
import numpy as np

from services.pi_tracker.image.blob import Blob, make_blob

# Pieces lie at most so many cells apart; what is between them is closed.
_GAP_CELLS = 2
# All pieces of a marker have at most this share of the area that it had: cells at its edge, which
# hold less paint, have no colour. (Whole markers' cells make up .65 to .85 of their areas.) What is
# more is the marker, and something else beside it.
_MOST_SHARE = 0.9
_SQUARE = np.ones((3, 3), np.uint8)


def joined(blobs: list[Blob], marker_px2: float) -> list[Blob]:
    """Blobs of a colour whose marker had an area of marker_px2 a moment ago; its pieces as one.

    The largest of them and those beside it, largest first.
    """
    first, *others = sorted(blobs, key=lambda blob: blob.cells, reverse=True)
    left = []
    for other in others:
        small_enough = first.area_px + other.area_px <= _MOST_SHARE * marker_px2
        if small_enough and _gap(first, other) <= _GAP_CELLS:
            first = _union(first, other)
        else:
            left.append(other)
    return [first, *left]


def _gap(a: Blob, b: Blob) -> int:
    """How many cells lie between two blobs' rectangles, along the axis along which more do."""
    (ax0, ay0, ax1, ay1), (bx0, by0, bx1, by1) = a.rect, b.rect
    return max(ax0 - bx1, bx0 - ax1, ay0 - by1, by0 - ay1)


def _union(a: Blob, b: Blob) -> Blob:
    """Both as one, with what is between them in its mask, but not in its area."""
    corners = np.array([a.rect, b.rect])
    x0, y0 = corners[:, :2].min(axis=0).tolist()
    x1, y1 = corners[:, 2:].max(axis=0).tolist()
    # Room around, so that closing does not see the rectangle's edge.
    room = _GAP_CELLS
    mask = np.zeros((y1 - y0 + 2 * room, x1 - x0 + 2 * room), np.uint8)
    for blob in (a, b):
        left, top, right, bottom = blob.rect
        part = mask[top - y0 + room : bottom - y0 + room, left - x0 + room : right - x0 + room]
        part |= (blob.mask != 0).view(np.uint8)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _SQUARE)[room:-room, room:-room]
    return make_blob(a.color, (x0, y0, x1, y1), np.ascontiguousarray(closed), a.cells + b.cells)
