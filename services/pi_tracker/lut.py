"""Markers by chroma lookup table: search where they can be, tell which blob is which, measure it.

Pure. A colour that is not seen is searched in the whole image from the next frame on; its place and size are remembered, so that a blob
that cannot be it is not taken for it.
"""

from __future__ import annotations

from collections.abc import Callable

from rhot.config import Tracker
from rhot.messages import Marker
from services.pi_tracker import roi
from services.pi_tracker.centroid import Centroid, centroids
from services.pi_tracker.colors import ColorTable
from services.pi_tracker.frame import Frame
from services.pi_tracker.identity import Identity, shape_fits
from services.pi_tracker.noise import Noise
from services.pi_tracker.planes import Picture, Rect, picture
from services.pi_tracker.search import Blob, Searcher

# Every so many frames the whole image is searched although nothing is lost, so that a mistake does not last.
_REVIEW = 15
# A marker that fits the others worse than this may be a thing in the room.
_LEAST_SUPPORT = 0.3
Lap = Callable[[str], None]


class LutFinder:
    """Markers of one camera, frame after frame."""

    def __init__(self, table: ColorTable, settings: Tracker, lap: Lap) -> None:
        self._names = table.names
        self._settings = settings
        self._searcher = Searcher(table, settings)
        self._lap = lap
        self._noise = Noise()
        self._searches = 0
        self._identity = Identity(len(table.names), settings.roi_margin_px)
        # Where all markers were, None if one was not seen, and how far around it they will be.
        self._hull: Rect | None = None
        self._margin_px = settings.roi_margin_px

    def find(self, frame: Frame) -> list[Marker]:
        """Markers of one image, at most one per colour."""
        image = picture(frame)
        self._noise.look(image)
        blobs = self._search(image)
        self._lap("search")
        chosen = {color: choice for color, choice in enumerate(self._identity.choose(blobs, frame.stamp_ns)) if choice is not None}
        self._lap("identity")
        # A marker that strayed from the others is looked for everywhere the next time.
        self._expect([choice.blob.rect for choice in chosen.values() if choice.support >= _LEAST_SUPPORT])
        markers = []
        measured = centroids(image, [choice.blob for choice in chosen.values()], self._noise)
        for (color, choice), found in zip(chosen.items(), measured, strict=True):
            self._identity.follow(color, found.x_px, found.y_px, found.area_px, frame.stamp_ns)
            markers.append(_marker(self._names[color], found, choice.certainty))
        self._lap("centroid")
        return markers

    def _search(self, image: Picture) -> list[list[Blob]]:
        """Plausible blobs of each colour: near the last places, else in the whole image."""
        everywhere = roi.whole(image.size)
        self._searches += 1
        if self._hull is None or self._searches % _REVIEW == 0:
            return self._blobs(image, everywhere)
        region = roi.around(self._hull, self._margin_px, image.size)
        found = self._blobs(image, region)
        if any(not own or roi.cut(max(own, key=_cells).rect, region, image.size) for own in found):
            # A marker has moved further than the margin: the same frame may still show it.
            return self._blobs(image, everywhere)
        return found

    def _expect(self, rects: list[Rect]) -> None:
        """Where to look in the next frame, given where markers are in this one."""
        if not rects or len(rects) < len(self._names):
            self._hull = None
            return
        now = roi.hull(rects)
        self._margin_px = roi.margin(self._hull, now, self._settings.roi_margin_px)
        self._hull = now

    def _blobs(self, image: Picture, region: Rect) -> list[list[Blob]]:
        """Plausible blobs of each colour in a rectangle."""
        found: list[list[Blob]] = [[] for _ in self._names]
        for blob in self._searcher.blobs(image, region):
            if shape_fits(blob, self._settings.max_area_px):
                found[blob.color].append(blob)
        return found


def _cells(blob: Blob) -> int:
    return blob.cells


def _marker(name: str, found: Centroid, certainty: float) -> Marker:
    return Marker(
        color=name,
        # A hundredth of the best sigma is as fine as the position deserves.
        x_px=round(found.x_px, 3),
        y_px=round(found.y_px, 3),
        area_px=round(found.area_px, 1),
        sigma_px=round(found.sigma_px, 4),
        quality=round(found.quality * certainty, 3),
    )
