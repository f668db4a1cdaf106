"""Dots of one colour in the pictures of one camera: search, sub-pixel centres, identity.

Pure. The search and the centres are those of single markers (detect/, measure/); all blobs of the
colour go into the tracker of dots, which tells them apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rhot.files.rig_tables import Tracker
from rhot.messages import Marker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import ColorTable
from services.pi_tracker.dots.dot import Dot, Patch, SeenPatches
from services.pi_tracker.dots.either import EitherTracker
from services.pi_tracker.dots.hindsight.looking_back import look_back
from services.pi_tracker.dots.patches.faint import FaintFinder
from services.pi_tracker.dots.patches.parts import parts_of
from services.pi_tracker.dots.patches.slivers import SliverFinder
from services.pi_tracker.dots.search import Search
from services.pi_tracker.dots.tracker import DotTracker
from services.pi_tracker.identify.blob_shape import is_paint_shaped
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import Picture, picture
from services.pi_tracker.measure.fastest import centroids

# The centre of a part of a blob is known to this share of its diameter, and so much less of its
# quality is left.
_PART_SIGMA, _PART_QUALITY = 0.15, 0.5
# Where as many blobs as this share of the dots are found, they are one dot each as a rule. (Of
# discs that double their width from one picture to the next each was four without. Six clips of 8
# dots, the tuning half of benchmarks/dots_pictures.py, are told the same to .2 % with .75, 1 or
# without: it matters where a picture comes into focus.)
_NEARLY_ALL = 0.75


class DotFinder:
    """Follows the dots of one colour through the frames of one camera."""

    def __init__(
        self,
        table: ColorTable,
        color: str,
        settings: Tracker,
        landmarks: Sequence[str],
        size_px: tuple[int, int],
        seeds: Mapping[str, tuple[float, float]] | None = None,
        *,
        remembers: bool = False,
    ) -> None:
        """table has the colour, and others that are not to be taken for it.

        landmarks and seeds are DotTracker's; size_px is the picture's. remembers keeps the patches
        of all pictures, for looked_back().
        """
        self._given = (tuple(landmarks), size_px, seeds)
        self._seen: list[SeenPatches] | None = [] if remembers else None
        self._color, self._settings = color, settings
        self._noise = Noise()
        # Where the dots of the last picture were, those that were not seen, too.
        self._places: dict[str, tuple[float, float]] = {}
        self._faint = FaintFinder()
        self.use(table)
        self.tracker = EitherTracker(landmarks, size_px, seeds)

    def use(self, table: ColorTable) -> None:
        """Search with another table from the next frame on; dots keep their names."""
        self._class = table.names.index(self._color)
        self._detector = BlobDetector(table, self._settings)
        self._slivers = SliverFinder(table, self._class, self._settings)

    def find(self, frame: Frame) -> dict[str, Dot]:
        """The dots of one picture by landmark; empty until tracking has started."""
        image = picture(frame)
        self._noise.update(image)
        blobs = [
            blob
            for blob in self._detector.detect(image, search_region.whole(image.size))
            if blob.color == self._class and is_paint_shaped(blob, self._settings.max_area_px)
        ]
        before, area_px2 = self._places, self.tracker.dot_area_px2
        dots_px = list(before.values())
        blobs += self._slivers.beside(blobs, image, dots_px, area_px2)
        patches, time_s = self._patches(image, blobs), frame.stamp_ns * 1e-9
        patches += self._faint.find(image, blobs, dots_px, area_px2, self._noise.chroma)
        if self._seen is not None:
            self._seen.append(SeenPatches(time_s, patches))
        dots = self.tracker.step(patches, time_s)
        self._places = {name: (dot.x_px, dot.y_px) for name, dot in dots.items()}
        moved_px = [
            math.dist(before[name], at) for name, at in self._places.items() if name in before
        ]
        self._faint.note(image, blobs, moved_px)
        return dots

    @property
    def seen(self) -> list[SeenPatches]:
        """The patches of all pictures so far; none if nothing is remembered."""
        return self._seen or []

    def looked_back(self, advance: Callable[[], None] = lambda: None) -> list[dict[str, Dot]]:
        """The dots of all pictures so far, with hindsight; none if nothing is remembered.

        advance is called looking_back.LOOKS times for each picture.
        """
        return look_back(self._begun, self.seen, advance)

    def _begun(self, search: Search) -> DotTracker:
        return DotTracker(*self._given, search, remembers=True)

    def _dot_area(self, blobs: list[Blob]) -> float:
        """How large a dot is that shows as a whole, 0 while it is unknown.

        All that are large at once are no dots that touch: blurred ones before were small.
        """
        known = self.tracker.dot_area_px2
        if not known or len(blobs) < _NEARLY_ALL * len(self.tracker.names):
            return known
        return max(known, float(np.median([blob.area_px for blob in blobs])))

    def _patches(self, image: Picture, blobs: list[Blob]) -> list[Patch]:
        found: list[Patch] = []
        if not blobs:
            return found
        measured = centroids(image, blobs, self._noise)
        area_px2 = self._dot_area(blobs)
        for number, (blob, one) in enumerate(zip(blobs, measured, strict=True)):
            parts = parts_of(blob, area_px2)
            if len(parts) == 1:
                found.append(Patch(one.x_px, one.y_px, blob.area_px, one.sigma_px, one.quality))
                continue
            for x, y, area in parts:
                sigma = _PART_SIGMA * math.sqrt(4.0 / math.pi * area)
                whole = (one.x_px, one.y_px)
                found.append(Patch(x, y, area, sigma, _PART_QUALITY * one.quality, number, whole))
        return found


def dot_markers(dots: Mapping[str, Dot], names: Mapping[str, str]) -> list[Marker]:
    """The dots that were seen as markers with these names by landmark; carried ones are none."""
    return [
        Marker(
            color=names[landmark],
            x_px=round(dot.x_px, 3),
            y_px=round(dot.y_px, 3),
            area_px=round(dot.area_px, 1),
            sigma_px=round(dot.sigma_px, 4),
            quality=round(min(max(dot.quality, 0.0), 1.0), 3),
        )
        for landmark, dot in dots.items()
        if dot.state != "carried"
    ]
