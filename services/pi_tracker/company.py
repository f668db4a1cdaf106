"""Markers keep company: those of one hand lie within a hand's reach of each other and are of one size.

Pure. With one colour only there is no company, and none is asked for.
"""

from __future__ import annotations

from services.pi_tracker.search import Blob

# Wrist to finger tip is 180 mm, thumb to little finger spread 200 mm; paint patches are 12 to 16 mm wide: markers lie within
# 14 patch widths, mostly within 10.
_REACH_WIDTHS = 10.0
# Tips seen end on or half hidden and a dab on the wrist seen in full differ in area up to this.
_SIZE_RATIO = 5.0


def support(blob: Blob, others: list[list[Blob]]) -> float:
    """How well a blob fits the best blob of each other colour, mean over those colours, 0..1; 1 if there are none."""
    seen = [blobs for blobs in others if blobs]
    if not seen:
        return 1.0
    return sum(max(_fit(blob, other) for other in blobs) for blobs in seen) / len(seen)


def _fit(a: Blob, b: Blob) -> float:
    smaller, larger = sorted((a.area_px, b.area_px))
    (ax, ay), (bx, by) = a.centre_px, b.centre_px
    apart2 = (ax - bx) ** 2 + (ay - by) ** 2
    # Of two sizes the smaller one is less often wrong: things in the room and blur make blobs large.
    near = 1.0 / (1.0 + (apart2 / (_REACH_WIDTHS**2 * max(smaller, 1.0))) ** 2)
    return near * min(1.0, _SIZE_RATIO * smaller / max(larger, 1.0))
