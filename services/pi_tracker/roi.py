"""Where to look: the rectangles around the last markers, or the whole image for those that are lost.

Pure. Rectangles are in cells of 2x2 pixels. A rectangle outside the image is clamped to it and keeps at least one cell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from services.pi_tracker.planes import Rect

# A hand at rest still trembles and turns; and from one frame to the next a motion seldom more than doubles, also in another marker. (What
# escapes is found in the same frame by searching the whole image.)
_STILL_MARGIN_PX, _STEPS = 12, 2


def whole(size: tuple[int, int]) -> Rect:
    """All of an image of (width, height) cells."""
    return (0, 0, size[0], size[1])


def around(rect: Rect, margin_px: int, size: tuple[int, int]) -> Rect:
    """A marker's rectangle with a margin in pixels on each side, clamped to the image. RHOT, section 9.1."""
    margin = (margin_px + 1) // 2
    x0, y0, x1, y1 = rect
    left, top = min(max(x0 - margin, 0), size[0] - 1), min(max(y0 - margin, 0), size[1] - 1)
    return (left, top, max(min(x1 + margin, size[0]), left + 1), max(min(y1 + margin, size[1]), top + 1))


def hull(rects: Sequence[Rect]) -> Rect:
    """The smallest rectangle around all, at least one: one search of a hand costs less than one for each of its markers."""
    return (min(r[0] for r in rects), min(r[1] for r in rects), max(r[2] for r in rects), max(r[3] for r in rects))


def margin(before: Mapping[int, Rect], now: Mapping[int, Rect], most_px: int) -> int:
    """The margin that the markers' motion from the last frame to this one asks for, at most most_px; most_px where it is unknown."""
    steps = [max(abs(b[0] - a[0]), abs(b[1] - a[1])) for key, b in now.items() if (a := before.get(key)) is not None]
    return min(most_px, _STILL_MARGIN_PX + _STEPS * 2 * max(steps)) if steps else most_px


def cut(blob: Rect, rect: Rect, size: tuple[int, int]) -> bool:
    """Whether a blob reaches the border of its rectangle where that is not the image's: there may be more of it outside."""
    return (
        (blob[0] <= rect[0] > 0)
        or (blob[1] <= rect[1] > 0)
        or (blob[2] >= rect[2] and rect[2] < size[0])
        or (blob[3] >= rect[3] and rect[3] < size[1])
    )
