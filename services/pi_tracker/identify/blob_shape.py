"""What a blob's size, shape and neighbours say: whether it may be a patch of paint. Pure."""

from __future__ import annotations

from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.planes import Rect

# Paint patches seen from any side, blurred by fast motion, stay within this ratio of sides and fill
# this share of their box.
_MAX_ASPECT, _MIN_FILL = 6.0, 0.3
# A small blob at the rim of a larger one of another colour is, as a rule, that one's edge in
# coloured light, when it is at most this share of the other's size and so many times as long as
# wide. (Of tips in first pictures before things of other paints' colours, where they are small
# beside them, 81 % were known while width did not count, and 89 %; 120 simulated rooms.)
_RIM_SHARE, _RIM_ASPECT = 0.6, 2.0


def is_paint_shaped(blob: Blob, max_area_px: float) -> bool:
    """Whether a blob's area, aspect and fill are those of a patch of paint."""
    x0, y0, x1, y1 = blob.rect
    width, height = x1 - x0, y1 - y0
    return (
        blob.area_px <= max_area_px
        and width <= _MAX_ASPECT * height
        and height <= _MAX_ASPECT * width
        and blob.cells >= _MIN_FILL * width * height
    )


def may_be_rim(blob: Blob, other: Blob) -> bool:
    """Whether a thin blob touches a larger one of another colour, and may be that one's edge."""
    x0, y0, x1, y1 = blob.rect
    width, height = x1 - x0, y1 - y0
    thin = max(width, height) >= _RIM_ASPECT * min(width, height)
    return thin and blob.cells <= _RIM_SHARE * other.cells and touch(blob.rect, other.rect)


def touch(a: Rect, b: Rect) -> bool:
    """Whether two rectangles of cells overlap or lie at most one cell apart."""
    return a[0] <= b[2] + 1 and b[0] <= a[2] + 1 and a[1] <= b[3] + 1 and b[1] <= a[3] + 1
