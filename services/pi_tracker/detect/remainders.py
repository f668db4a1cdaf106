"""What there is of a marker near its predicted place that a search has no blob of. Pure.

What mask filters took, as where another marker occludes it: ordinary blobs first; only without any,
thin ones beside the other's paint. Without these, what is nearly its colour; and of a colour whose
hues another has as well, what is nearly its own, whatever else it may be: where violet and blue
overlap, half a dab may be nearer to blue, and neither half is a blob.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec

from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import ColorTable
from services.pi_tracker.detect.near_colors import NearTables
from services.pi_tracker.identify.blob_shape import touch
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture

# About a marker's width around the place where it must be.
_MARGIN_PX = 14
# A thin blob beside another's paint counts when it is at least this share of the marker: an
# occluder's own edge is less. (Of the two crescents of half visible markers that the seam test took
# in the hard scene, one had .35, the other .47 of the marker's area.)
_MIN_THIN_SHARE = 0.25
# What is nearly the colour of a marker of which nothing else is found counts as it with such shares
# of its area. (A dab in shade was in no range for five frames: one clip of the other renderer, held
# out until then, 29.8 -> 5.8 mm at most at two frames; twelve others are as they were.)
_NEARLY_SHARES = 0.3, 1.1
# Those of some blobs that may be the marker.
Plausible = Callable[[list[Blob]], list[Blob]]


class LostMarker(NamedTuple):
    """A marker of a colour where it must be, px, how large it was lately and where all of it shows,
    and the rectangles of the other markers.
    """

    color: int
    place_px: tuple[float, float]
    area_px2: float
    whole_px2: float
    others: Sequence[Rect]


class Remainder(NamedTuple):
    """What may be the marker; only_nearly: it is nearly its colour at most."""

    blobs: list[Blob]
    only_nearly: bool


class Remainders:
    """Looks again, and less strictly, where a marker must be."""

    def __init__(self, table: ColorTable, near: NearTables, settings: Tracker) -> None:
        unfiltered = msgspec.structs.replace(settings, erode=0, dilate=0, gaussian_px=0)
        self._unfiltered = BlobDetector(table, unfiltered)
        self._near = BlobDetector(near.all, settings)
        self._alone = {color: BlobDetector(of, settings) for color, of in near.alone.items()}

    def find(self, picture: Picture, lost: LostMarker, plausible: Plausible) -> Remainder:
        """The blobs of a marker."""
        cell = search_region.cell_at(lost.place_px)
        region = search_region.around(cell, _MARGIN_PX, picture.size)
        for keep_thin in (False, True):
            blobs = plausible(self._unfiltered.detect(picture, region, keep_thin))
            least_px2 = _MIN_THIN_SHARE * lost.area_px2 if keep_thin else 0.0
            found = [blob for blob in blobs if blob.area_px >= least_px2]
            if found:
                return Remainder(found, only_nearly=False)
        found = _as_large(plausible(self._near.detect(picture, region)), lost)
        if not found and lost.color in self._alone:
            blobs = self._alone[lost.color].detect(picture, region)
            own = [
                blob._replace(color=lost.color)
                for blob in blobs
                if not any(touch(blob.rect, other) for other in lost.others)
            ]
            found = _as_large(plausible(own), lost)
        return Remainder(found, only_nearly=bool(found))


def _as_large(blobs: list[Blob], lost: LostMarker) -> list[Blob]:
    """Those about as large as the marker."""
    least_px2, most_px2 = (share * lost.whole_px2 for share in _NEARLY_SHARES)
    return [blob for blob in blobs if least_px2 <= blob.area_px <= most_px2]
