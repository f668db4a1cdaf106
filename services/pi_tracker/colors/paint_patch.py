"""The painted patch that a person points at: grown from a click, or found in a box around it.

Pure. A click on something grey, a box without a colour of its own, and places outside the picture
are CalibrationErrors saying so.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rhot.errors import CalibrationError
from services.pi_tracker.colors.pointer import MIN_CELLS, Pointer, search_window
from services.pi_tracker.colors.region_growing import (
    RegionStart,
    grow_region,
    start_at_click,
    start_in_box,
    touches_border,
)
from services.pi_tracker.image.chroma import Cells, Mask
from services.pi_tracker.image.planes import Rect

# Magenta runs into dark skin, whose chroma is hardly more than noise, and green into a poster: of
# that, little is within these shares of the usual tolerance, and of paint most (.85 at .7; of one
# click in a hundred .57). Chosen on the other renderer's tuning clips.
_TOLERANCES = (0.7, 0.5)
_STAYS = 0.5


@dataclass(frozen=True, eq=False)
class PaintPatch:
    """One patch in one picture, as masks of the whole picture."""

    color: str
    frame: int
    mask: Mask  # (h, w) its cells
    core: Mask  # (h, w) those clear of its rim
    whole: Mask  # (h, w) all that belongs to it, also outside the box

    @property
    def box_px(self) -> tuple[int, int, int, int]:
        """x, y, width, height."""
        rows, columns = np.nonzero(self.mask)
        x, y = 2 * int(columns.min()), 2 * int(rows.min())
        return x, y, 2 * int(columns.max()) + 2 - x, 2 * int(rows.max()) + 2 - y


def find_patch(cells: Cells, pointer: Pointer) -> PaintPatch:
    """The patch that is pointed at in a picture (h, w).

    Raises CalibrationError if there is none, or the place lies outside the picture.
    """
    rect = search_window(cells, pointer)
    x0, y0, x1, y1 = rect
    window = cells[y0:y1, x0:x1]
    start = _start(cells, rect, pointer)
    region = _grown(window, start, pointer)
    if not pointer.is_box:
        region = _without_leaks(window, start, pointer, region)
        if touches_border(region, rect, cells):
            raise CalibrationError(
                f"{pointer}: that colour goes on far beyond the click; is it the background, or a "
                "sleeve? Point at the paint itself"
            )
    mask = np.zeros(cells.shape, bool)
    mask[y0:y1, x0:x1] = region
    whole = mask | _beyond_box(cells, rect, region) if pointer.is_box else mask
    return PaintPatch(pointer.color, pointer.frame, mask, _core(mask), whole)


def _start(cells: Cells, rect: Rect, pointer: Pointer) -> RegionStart:
    if pointer.is_box:
        return start_in_box(cells, rect)
    x0, y0, x1, y1 = rect
    x, y = int(pointer.x_px) // 2 - x0, int(pointer.y_px) // 2 - y0
    return start_at_click(cells[y0:y1, x0:x1], x, y)


def _grown(window: Cells, start: RegionStart, pointer: Pointer, tolerance: float = 1.0) -> Mask:
    """The region (h, w) of a window, large enough to be a patch."""
    if start.chromaticity is None:
        reason = (
            "has no colour of its own: what is in it looks like what is around it"
            if pointer.is_box
            else "is on something grey"
        )
        raise CalibrationError(
            f"{pointer}: {reason}; point at the paint itself, in better light if it is dark"
        )
    region = grow_region(window, start.chromaticity, start.cells, tolerance)
    if region.any():
        # The start's colour was one place's; the region's own is a better one.
        middle = np.median(window[region].chromaticity, axis=0)
        region = grow_region(window, middle, region, tolerance)
    count = np.count_nonzero(region)
    if count < MIN_CELLS:
        raise CalibrationError(
            f"{pointer}: only {4 * count} px of one colour are there; {4 * MIN_CELLS} px are needed"
        )
    return region


def _without_leaks(window: Cells, start: RegionStart, pointer: Pointer, region: Mask) -> Mask:
    """A click's region, grown with less tolerance where most of it is only roughly like it."""
    for tolerance in _TOLERANCES:
        try:
            closer = _grown(window, start, pointer, tolerance)
        except CalibrationError:
            break
        if np.count_nonzero(closer) > _STAYS * np.count_nonzero(region):
            break
        region = closer
    return region


def _beyond_box(cells: Cells, rect: Rect, region: Mask) -> Mask:
    """Where a region that a box cuts continues outside it; (h, w) of the picture.

    Nothing if it does not end within a box's size: that is the background.
    """
    height, width = cells.shape
    x0, y0, x1, y1 = rect
    left, top = max(x0 - (x1 - x0), 0), max(y0 - (y1 - y0), 0)
    right, bottom = min(2 * x1 - x0, width), min(2 * y1 - y0, height)
    window = cells[top:bottom, left:right]
    starts = np.zeros(window.shape, bool)
    starts[y0 - top : y1 - top, x0 - left : x1 - left] = region
    grown = grow_region(window, np.median(window[starts].chromaticity, axis=0), starts)
    mask = np.zeros(cells.shape, bool)
    if not touches_border(grown, (left, top, right, bottom), cells):
        mask[top:bottom, left:right] = grown
    return mask


def _core(mask: Mask) -> Mask:
    """The patch without its rim, whose cells are mixtures.

    All of it if too little is left.
    """
    core = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    enough = max(4 * MIN_CELLS, 0.2 * np.count_nonzero(mask))
    return core if np.count_nonzero(core) >= enough else mask
