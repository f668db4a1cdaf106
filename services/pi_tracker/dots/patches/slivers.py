"""What shows of a dot that turns away: slivers that filters of the mask take for noise. Pure.

A mask is opened, so that noise is no marker, and with it goes what is one cell (two pixels) wide.
Near a dot of the last picture, and beside no other patch, such a sliver is what is left of that
dot, as a rule.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import ColorTable
from services.pi_tracker.identify.blob_shape import is_paint_shaped, touch
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.yuv_planes import Picture

# A sliver is no further from where a dot was than so many of its diameters, and no smaller than
# this share of it, nor than this. (18 clips of 8 dots, the tuning half of
# benchmarks/dots_pictures.py: of dots of which a third to a half shows 78 % have a patch without
# slivers, 92 % within 1 diameter, 97 % within 2, and none of the patches is false.)
_REACH, _LEAST, _LEAST_PX2 = 2.0, 0.05, 8.0


class SliverFinder:
    """Finds slivers of one colour near the dots of the last picture."""

    def __init__(self, table: ColorTable, color: int, settings: Tracker) -> None:
        """color is the number of the dots' colour in the table."""
        self._color, self._max_area_px = color, settings.max_area_px
        bare = msgspec.structs.replace(
            settings, erode=0, dilate=0, gaussian_px=0, min_area_px=_LEAST_PX2
        )
        self._detector = BlobDetector(table, bare)

    def beside(
        self,
        found: Sequence[Blob],
        image: Picture,
        dots_px: Sequence[tuple[float, float]],
        area_px2: float,
    ) -> list[Blob]:
        """Slivers that are none of the blobs found; dots' places in the last picture, their area.

        None where nothing is known of dots.
        """
        if not dots_px or area_px2 <= 0.0:
            return []
        reach = _REACH * math.sqrt(4.0 / math.pi * area_px2)
        cells = [(int(x) // 2, int(y) // 2, int(x) // 2 + 1, int(y) // 2 + 1) for x, y in dots_px]
        region = search_region.around(
            search_region.bounding_rect(cells), math.ceil(reach), image.size
        )
        return [
            blob
            for blob in self._detector.detect(image, region, keep_thin=True)
            if blob.color == self._color
            and blob.area_px >= _LEAST * area_px2
            and is_paint_shaped(blob, self._max_area_px)
            and not any(touch(blob.rect, other.rect) for other in found)
            and any(math.hypot(blob.x_px - x, blob.y_px - y) <= reach for x, y in dots_px)
        ]
