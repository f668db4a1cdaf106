"""Markers by chroma lookup table: search where they can be, tell which blob is which, measure it.

Pure. A colour that is not seen is searched in the whole image from the next frame on; its place and
size are remembered, so that a blob that cannot be it is not taken for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec

from rhot.files.config import Tracker
from rhot.messages import Marker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import Blob, Searcher
from services.pi_tracker.detect.color_table import ColorTable
from services.pi_tracker.identify.background import Room
from services.pi_tracker.identify.marker_identity import Identity, shape_fits
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import Picture, Rect, picture
from services.pi_tracker.measure.centroid import Centroid, centroids

# Every so many frames the whole image is searched although nothing is lost, so that a mistake does
# not last; and in the first ones, to learn what stands in the room.
_REVIEW, _FIRST = 15, 6
# A marker that fits the others worse than this may be a thing in the room.
_LEAST_SUPPORT = 0.3
# Where half of a disc is hidden, the centre of the rest is 4 r / (3 pi) from the whole's: .24 of
# the square root of its area, in some direction; so much per coordinate and share. And never is all
# of it hidden.
_HIDDEN_SIGMA, _MOST_HIDDEN = 0.34, 0.9
# About a marker's width around the place where it must be.
_SLIVER_PX = 14
# A thin one beside another's paint counts when it is at least this share of the marker: an
# occluder's own edge is less. (Of the two crescents of half visible markers that the seam test took
# in the hard scene, one had .35, the other .47 of the marker's area.)
_CRESCENT = 0.25
Lap = Callable[[str], None]


class LutFinder:
    """Markers of one camera, frame after frame."""

    def __init__(self, table: ColorTable, settings: Tracker, lap: Lap) -> None:
        self._names = table.names
        self._settings = settings
        self._searcher = Searcher(table, settings)
        self._unfiltered = Searcher(
            table, msgspec.structs.replace(settings, erode=0, dilate=0, gaussian_px=0)
        )
        self._lap = lap
        self._noise = Noise()
        self._searches = 0
        self._identity = Identity(len(table.names), settings.roi_margin_px)
        self._room = Room()
        # All blobs of the frame in hand, things in the room among them, and where they were
        # searched.
        self._all: list[Blob] = []
        self._region: Rect = (0, 0, 0, 0)
        # Where all markers were, None if one was not seen, and how far around it they will be.
        self._hull: Rect | None = None
        self._margin_px = settings.roi_margin_px

    def find(self, frame: Frame) -> list[Marker]:
        """Markers of one image, at most one per colour."""
        image = picture(frame)
        self._noise.look(image)
        blobs = self._search(image)
        for color, own in enumerate(blobs):
            place = None if own else self._identity.expected(color, frame.stamp_ns)
            if place is not None:
                own += self._slivers(image, color, place)
        self._lap("search")
        chosen = {
            color: choice
            for color, choice in enumerate(self._identity.choose(blobs, frame.stamp_ns))
            if choice is not None
        }
        if len(self._all) > len(chosen) or not self._room.settled:
            self._room.learn(
                image,
                self._region,
                self._all,
                [choice.blob.rect for choice in chosen.values()],
                self._noise,
                frame.stamp_ns,
            )
        self._lap("identity")
        # A marker that strayed from the others is looked for everywhere the next time.
        self._expect(
            [choice.blob.rect for choice in chosen.values() if choice.support >= _LEAST_SUPPORT]
        )
        markers = []
        measured = centroids(image, [choice.blob for choice in chosen.values()], self._noise)
        for (color, choice), found in zip(chosen.items(), measured, strict=True):
            hidden = self._identity.follow(
                color, found.x_px, found.y_px, found.area_px, frame.stamp_ns
            )
            markers.append(_marker(self._names[color], found, choice.certainty, hidden))
        self._lap("centroid")
        return markers

    def _search(self, image: Picture) -> list[list[Blob]]:
        """Plausible blobs of each colour: near the last places, else in the whole image."""
        everywhere = search_region.whole(image.size)
        self._searches += 1
        if self._hull is None or self._searches <= _FIRST or self._searches % _REVIEW == 0:
            return self._blobs(image, everywhere)
        region = search_region.around(self._hull, self._margin_px, image.size)
        found = self._blobs(image, region)
        if any(
            not own or search_region.cut(max(own, key=_cells).rect, region, image.size)
            for own in found
        ):
            # A marker has moved further than the margin: the same frame may still show it.
            return self._blobs(image, everywhere)
        return found

    def _slivers(self, image: Picture, color: int, place: tuple[float, float]) -> list[Blob]:
        """What the mask filters took away of a marker that another one hides, where it must be."""
        column, row = (
            min(max(int(v) // 2, 0), n - 1) for v, n in zip(place, image.size, strict=True)
        )
        region = search_region.around((column, row, column + 1, row + 1), _SLIVER_PX, image.size)
        for thin in (False, True):
            found = self._room.without(
                image, self._unfiltered.blobs(image, region, thin), self._noise
            )
            least_px2 = _CRESCENT * self._identity.area_px2(color) if thin else 0.0
            found = [
                b
                for b in found
                if b.color == color
                and b.area_px >= least_px2
                and shape_fits(b, self._settings.max_area_px)
            ]
            if found:
                return found
        return []

    def _expect(self, rects: list[Rect]) -> None:
        """Where to look in the next frame, given where markers are in this one."""
        if not rects or len(rects) < len(self._names):
            self._hull = None
            return
        now = search_region.hull(rects)
        self._margin_px = search_region.margin(self._hull, now, self._settings.roi_margin_px)
        self._hull = now

    def _blobs(self, image: Picture, region: Rect) -> list[list[Blob]]:
        """Plausible blobs of each colour in a rectangle."""
        found: list[list[Blob]] = [[] for _ in self._names]
        self._region, self._all = region, self._searcher.blobs(image, region)
        for blob in self._room.without(image, self._all, self._noise):
            if shape_fits(blob, self._settings.max_area_px):
                found[blob.color].append(blob)
        return found


def _cells(blob: Blob) -> int:
    return blob.cells


def _marker(name: str, found: Centroid, certainty: float, hidden: float) -> Marker:
    """hidden is the share of it that is covered: it moves the centre, nobody knows where to."""
    whole_px2 = found.area_px / (1.0 - min(hidden, _MOST_HIDDEN))
    return Marker(
        color=name,
        # A hundredth of the best sigma is as fine as the position deserves.
        x_px=round(found.x_px, 3),
        y_px=round(found.y_px, 3),
        area_px=round(found.area_px, 1),
        sigma_px=round(
            math.hypot(found.sigma_px, _HIDDEN_SIGMA * hidden * math.sqrt(whole_px2)), 4
        ),
        quality=round(found.quality * certainty * (1.0 - hidden), 3),
    )
