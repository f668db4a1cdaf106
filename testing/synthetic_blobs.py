"""Blobs as a detector would find them, without a picture: squares, and six markers of a hand.

For tests of data association. Pure.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.pi_tracker.identify.marker_identity import MarkerIdentity
from services.pi_tracker.image.blob import Blob, make_blob
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.planes import Rect

FRAME_NS = 33_333_333
START_NS = 1_700_000_000_000_000_000
# What the markers of hand_blobs() are painted with, in their order.
COLORS = ("magenta", "blue", "cyan", "green", "lime", "violet")
# Places of five tips in an arc and a wrist, px from the middle of the hand.
_HAND_PX = ((-60, -20), (-30, -60), (0, -70), (30, -60), (55, -40), (0, 60))


def filled_blob(color: int, rect: Rect, mask: Image | None = None) -> Blob:
    """A blob of a rectangle of cells, full but for a mask (h, w)."""
    x0, y0, x1, y1 = rect
    mask = np.ones((y1 - y0, x1 - x0), np.uint8) if mask is None else mask
    return make_blob(color, rect, mask, int(np.count_nonzero(mask)))


def square_blob(color: int, x_px: float, y_px: float, side_px: int = 14) -> Blob:
    """A square blob about a pixel."""
    cells = max(side_px // 2, 1)
    x0, y0 = round(x_px / 2 - cells / 2), round(y_px / 2 - cells / 2)
    return filled_blob(color, (x0, y0, x0 + cells, y0 + cells))


def hand_blobs(x_px: float, y_px: float, side_px: int = 14) -> list[Blob]:
    """One blob per colour: five tips in an arc and a wrist."""
    return [
        square_blob(color, x_px + dx, y_px + dy, side_px) for color, (dx, dy) in enumerate(_HAND_PX)
    ]


def nothing_known(_blob: Blob) -> bool:
    """Of the room: no blob looks like it."""
    return False


def associated(
    identity: MarkerIdentity,
    blobs: list[list[Blob]],
    seq: int,
    like_room: Callable[[Blob], bool] = nothing_known,
) -> list[Blob | None]:
    """Associate a frame's blobs, and update with what was associated; the blobs."""
    stamp_ns = START_NS + seq * FRAME_NS
    associations = identity.associate(blobs, stamp_ns, like_room)
    blobs_found = [None if one is None else one.blob for one in associations]
    for color, found in enumerate(blobs_found):
        if found is not None:
            area_px2 = found.area_px
            identity.update(color, found.x_px, found.y_px, area_px2, area_px2, stamp_ns)
    return blobs_found
