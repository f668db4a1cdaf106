"""Regions of interest: the rectangle to search in the next frame, and how far markers may move.

Pure. Rectangles are in cells of 2x2 pixels. A rectangle outside the image is clamped to it and
keeps at least one cell.
"""

from __future__ import annotations

from collections.abc import Iterable

from services.pi_tracker.image.planes import Rect

# A hand at rest still trembles and turns, and from one frame to the next a motion seldom more than
# doubles. (What escapes is found in the same frame by searching the whole image.)
_REST_MARGIN_PX, _MOTION_FACTOR = 8, 2


def whole(size: tuple[int, int]) -> Rect:
    """All of an image of (width, height) cells."""
    return (0, 0, size[0], size[1])


def around(rect: Rect, margin_px: int, size: tuple[int, int]) -> Rect:
    """A marker's rectangle with a margin in pixels on each side, clamped to the image.

    RHOT, section 9.1.
    """
    margin = (margin_px + 1) // 2
    x0, y0, x1, y1 = rect
    left, top = min(max(x0 - margin, 0), size[0] - 1), min(max(y0 - margin, 0), size[1] - 1)
    return (
        left,
        top,
        max(min(x1 + margin, size[0]), left + 1),
        max(min(y1 + margin, size[1]), top + 1),
    )


def cell_at(place_px: tuple[float, float]) -> Rect:
    """The cell with a pixel."""
    column, row = (int(px) // 2 for px in place_px)
    return column, row, column + 1, row + 1


def bounding_rect(rects: Iterable[Rect]) -> Rect:
    """The smallest rectangle around all, at least one.

    One search of a hand costs less than one for each of its markers.
    """
    x0, y0, x1, y1 = zip(*rects, strict=True)
    return (min(x0), min(y0), max(x1), max(y1))


def motion_margin(before: Rect | None, now: Rect, max_px: int) -> int:
    """The margin in px for the next frame, from the motion of the markers' rectangle.

    before is the rectangle of the last frame, None where it is unknown: then max_px.
    """
    if before is None:
        return max_px
    step_cells = max(abs(new - old) for new, old in zip(now, before, strict=True))
    return min(max_px, _REST_MARGIN_PX + _MOTION_FACTOR * 2 * step_cells)


def is_clipped(blob: Rect, rect: Rect, size: tuple[int, int]) -> bool:
    """Whether a blob reaches the border of its search rectangle: there may be more of it outside.

    Where that border is the image's, too, there is no more.
    """
    return (
        (blob[0] <= rect[0] > 0)
        or (blob[1] <= rect[1] > 0)
        or (blob[2] >= rect[2] and rect[2] < size[0])
        or (blob[3] >= rect[3] and rect[3] < size[1])
    )
