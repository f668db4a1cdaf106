"""Where to look: the rectangles around the last markers, or the whole image for those that are
lost.

Pure. Rectangles are in cells of 2x2 pixels. A rectangle outside the image is clamped to it and
keeps at least one cell.
"""

from __future__ import annotations

from collections.abc import Iterable

from services.pi_tracker.image.yuv_planes import Rect

# A hand at rest still trembles and turns, and from one frame to the next a motion seldom more than
# doubles. (What escapes is found in the same frame by searching the whole image.)
_STILL_MARGIN_PX, _STEPS = 8, 2


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


def hull(rects: Iterable[Rect]) -> Rect:
    """The smallest rectangle around all, at least one: one search of a hand costs less than one for
    each of its markers.
    """
    x0, y0, x1, y1 = zip(*rects, strict=True)
    return (min(x0), min(y0), max(x1), max(y1))


def margin(before: Rect | None, now: Rect, most_px: int) -> int:
    """The margin that the motion of the markers' hull from the last frame to this one asks for.

    most_px where it is unknown.
    """
    if before is None:
        return most_px
    step = max(
        abs(now[0] - before[0]),
        abs(now[1] - before[1]),
        abs(now[2] - before[2]),
        abs(now[3] - before[3]),
    )
    return min(most_px, _STILL_MARGIN_PX + _STEPS * 2 * step)


def cut(blob: Rect, rect: Rect, size: tuple[int, int]) -> bool:
    """Whether a blob reaches the border of its rectangle where that is not the image's: there may
    be more of it outside.
    """
    return (
        (blob[0] <= rect[0] > 0)
        or (blob[1] <= rect[1] > 0)
        or (blob[2] >= rect[2] and rect[2] < size[0])
        or (blob[3] >= rect[3] and rect[3] < size[1])
    )
