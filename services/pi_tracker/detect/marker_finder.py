"""Markers of one camera, frame after frame: blob search, data association, sub-pixel centroid.

Pure. A colour that is not seen is searched in the whole image from the next frame on. Its place and
size are remembered, so that a blob that cannot be it is not taken for it.
"""

from __future__ import annotations

from collections.abc import Callable

from rhot.files.rig_tables import Tracker
from rhot.messages import Marker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import ColorTable
from services.pi_tracker.detect.near_colors import NearTables
from services.pi_tracker.detect.remainders import LostMarker, Remainders
from services.pi_tracker.identify.background import BackgroundModel
from services.pi_tracker.identify.blob_shape import is_paint_shaped, touch
from services.pi_tracker.identify.hand_layout import Landmarks
from services.pi_tracker.identify.marker_identity import Association, MarkerIdentity
from services.pi_tracker.identify.pieces import joined
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.planes import Rect
from services.pi_tracker.image.yuv_planes import Picture, picture
from services.pi_tracker.measure.cut_marker import CutMarkers
from services.pi_tracker.measure.fastest import centroids
from services.pi_tracker.measure.grown_blob import Growth, NearPaint, limit
from services.pi_tracker.measure.occluded_marker import doubts_px, marker_of

# Every so many frames the whole image is searched although nothing is lost, so that a mistake does
# not last; and in the first ones, to learn the static background.
_FULL_SEARCH_PERIOD, _FIRST_FRAMES = 15, 6
# A marker less consistent with the others than this may be something in the background.
_MIN_CONSISTENCY = 0.3
# Cells around a marker in which no background is learnt: its own rim, in the colours of blur and of
# light from the side; and more around what is smaller than the hand's markers are, a piece of one.
_MARKER_MARGIN = 4
# So long nor where a marker must be that is not found: what stays there may be it. (Seventeen rooms
# with things in the paints' colours, both cameras, tips found: 87.1 % without, 90.2 with one second
# and with two. A dim hand at rest lost one tip after the other, 26 and 93 %.)
_UNLEARNT_NS = 1_000_000_000
# Called with the name of each stage at its end.
OnStage = Callable[[str], None]


class MarkerFinder:
    """Finds the markers of one camera, frame after frame."""

    def __init__(
        self,
        table: ColorTable,
        near: NearTables,
        settings: Tracker,
        on_stage: OnStage,
        landmarks: Landmarks,
    ) -> None:
        self._names = table.names
        self._settings = settings
        self._detector = BlobDetector(table, settings)
        self._remainders = Remainders(table, near, settings)
        self._near = NearPaint(near.all)
        self._on_stage = on_stage
        self._noise = Noise()
        self._frame_count = 0
        self._identity = MarkerIdentity(table.names, settings.roi_margin_px, landmarks)
        self._background = BackgroundModel()
        self._cut = CutMarkers()
        # All blobs of this frame, background among them, and the rectangle they were searched in.
        self._all_blobs: list[Blob] = []
        self._searched: Rect = (0, 0, 0, 0)
        # Markers of this frame that are nearly their colour at most.
        self._only_nearly: set[int] = set()
        # The rectangle of all markers, None if one was not seen, and how far around it they will be
        # in the next frame.
        self._markers_rect: Rect | None = None
        self._margin_px = settings.roi_margin_px

    @property
    def searched_px(self) -> tuple[int, int, int, int]:
        """Left, top, right and bottom of what was searched in the last image, in its pixels."""
        left, top, right, bottom = self._searched
        return 2 * left, 2 * top, 2 * right, 2 * bottom

    def find(self, frame: Frame) -> list[Marker]:
        """Markers of one image, at most one per colour."""
        image = picture(frame)
        self._noise.update(image)
        blobs = self._search(image, frame.stamp_ns)
        self._on_stage("search")
        associated = {
            color: association
            for color, association in enumerate(
                self._identity.associate(
                    blobs,
                    frame.stamp_ns,
                    lambda blob: self._background.resembles(image, blob, self._noise),
                )
            )
            if association is not None
        }
        if self._identity.mistaken:
            # Markers were learnt as the room.
            self._background = BackgroundModel()
        self._update_background(image, associated, frame.stamp_ns)
        self._on_stage("identity")
        # A marker that strayed from the others is searched everywhere the next time.
        self._set_search_region(
            [
                association.blob.rect
                for association in associated.values()
                if association.consistency >= _MIN_CONSISTENCY
            ]
        )
        markers = self._measure(image, associated, frame.stamp_ns)
        self._on_stage("centroid")
        return markers

    def _search(self, image: Picture, stamp_ns: int) -> list[list[Blob]]:
        """Plausible blobs of each colour, remainders of occluded markers among them.

        Pieces of a marker that was seen a moment ago are one.
        """
        blobs = self._search_all_colors(image)
        self._only_nearly.clear()
        for color, own in enumerate(blobs):
            if not own:
                own += self._find_remainders(image, blobs, color, stamp_ns)
            if len(own) > 1 and self._identity.predicted(color, stamp_ns) is not None:
                own[:] = joined(own, self._identity.whole_px2(color))
        return blobs

    def _search_all_colors(self, image: Picture) -> list[list[Blob]]:
        """Plausible blobs of each colour: near the last places, else in the whole image."""
        whole = search_region.whole(image.size)
        self._frame_count += 1
        full_search = self._identity.may_be_elsewhere or (
            self._frame_count <= _FIRST_FRAMES or self._frame_count % _FULL_SEARCH_PERIOD == 0
        )
        if self._markers_rect is None or full_search:
            return self._detect(image, whole)
        region = search_region.around(self._markers_rect, self._margin_px, image.size)
        found = self._detect(image, region)
        if any(
            not own
            or search_region.is_clipped(
                (own[0] if len(own) == 1 else max(own, key=_cells)).rect, region, image.size
            )
            for own in found
        ):
            # A marker has moved further than the margin: the same frame may still show it.
            return self._detect(image, whole)
        return found

    def _detect(self, image: Picture, region: Rect) -> list[list[Blob]]:
        """Plausible blobs of each colour in a rectangle."""
        found: list[list[Blob]] = [[] for _ in self._names]
        self._searched, self._all_blobs = region, self._detector.detect(image, region)
        for blob in self._background.foreground(image, self._all_blobs, self._noise):
            if is_paint_shaped(blob, self._settings.max_area_px):
                found[blob.color].append(blob)
        return found

    def _find_remainders(
        self, image: Picture, blobs: list[list[Blob]], color: int, stamp_ns: int
    ) -> list[Blob]:
        """What there is of a marker near its predicted place that a search has no blob of.

        Taken from the other colours' blobs where it is nearly its colour at most.
        """
        identity = self._identity
        predicted_px = identity.predicted(color, stamp_ns)
        if predicted_px is None:
            return []
        others = [
            identity.likeliest(other, own, stamp_ns) for other, own in enumerate(blobs) if own
        ]
        areas_px2 = identity.area_px2(color), identity.whole_px2(color)
        lost = LostMarker(color, predicted_px, *areas_px2, [other.rect for other in others])
        found = self._remainders.find(
            image, lost, lambda those: self._of_color(image, color, those)
        )
        if found.only_nearly:
            self._only_nearly.add(color)
            rects = [blob.rect for blob in found.blobs]
            for own in blobs:
                own[:] = [
                    blob
                    for blob in own
                    if any(blob is other for other in others)
                    or not any(touch(blob.rect, rect) for rect in rects)
                ]
        return found.blobs

    def _of_color(self, image: Picture, color: int, blobs: list[Blob]) -> list[Blob]:
        """Those of a colour that may be its marker."""
        return [
            blob
            for blob in self._background.foreground(image, blobs, self._noise)
            if blob.color == color and is_paint_shaped(blob, self._settings.max_area_px)
        ]

    def _update_background(
        self, image: Picture, associated: dict[int, Association], stamp_ns: int
    ) -> None:
        """Learn what was found and is no marker, while there is anything to learn."""
        if len(self._all_blobs) > len(associated) or not self._background.settled:
            usual = self._identity.width_cells()
            markers = [
                _unlearnt_around(association.blob.rect, usual)
                for association in associated.values()
            ] + [
                _unlearnt_around(search_region.cell_at(place_px), usual)
                for color in range(len(self._names))
                if color not in associated
                and (place_px := self._identity.predicted(color, stamp_ns, _UNLEARNT_NS))
            ]
            self._background.update(
                image, self._searched, self._all_blobs, markers, self._noise, stamp_ns
            )

    def _set_search_region(self, rects: list[Rect]) -> None:
        """Where to search in the next frame, given the markers' rectangles in this one."""
        if not rects or len(rects) < len(self._names):
            self._markers_rect = None
            return
        now = search_region.bounding_rect(rects)
        self._margin_px = search_region.motion_margin(
            self._markers_rect, now, self._settings.roi_margin_px
        )
        self._markers_rect = now

    def _measure(
        self, image: Picture, associated: dict[int, Association], stamp_ns: int
    ) -> list[Marker]:
        """Sub-pixel positions; takes them into the tracks."""
        blobs = [association.blob for association in associated.values()]
        identity = self._identity
        limits = [
            limit(
                blob,
                identity.area_px2(color),
                identity.whole_px2(color),
                identity.found_px2(color),
            )
            for color, blob in zip(associated, blobs, strict=True)
        ]
        growth = Growth(self._near, limits) if any(most for most, _ in limits) else None
        measured = centroids(image, blobs, self._noise, growth)
        found = dict(zip(associated, zip(blobs, measured, strict=True), strict=True))
        measured = self._cut.restored(found, image.size, stamp_ns)
        doubts = doubts_px(
            [
                identity.departure_px(color, one.x_px, one.y_px, stamp_ns)
                for color, one in zip(associated, measured, strict=True)
            ],
            [one.area_px for one in measured],
            [identity.whole_px2(color) for color in associated],
        )
        markers = []
        for (color, association), centroid, doubt_px in zip(
            associated.items(), measured, doubts, strict=True
        ):
            occluded = identity.update(
                color,
                centroid.x_px,
                centroid.y_px,
                centroid.area_px,
                # What is nearly its colour says nothing of what is found in its range.
                0.0 if color in self._only_nearly else association.blob.area_px,
                stamp_ns,
            )
            markers.append(
                marker_of(self._names[color], centroid, association.certainty, occluded, doubt_px)
            )
        return markers


def _unlearnt_around(rect: Rect, usual_cells: float) -> Rect:
    """A marker's rectangle and its surroundings; usual_cells: how wide the hand's markers are."""
    x0, y0, x1, y1 = rect
    margin = _MARKER_MARGIN + max(round(usual_cells) - min(x1 - x0, y1 - y0), 0)
    return x0 - margin, y0 - margin, x1 + margin, y1 + margin


def _cells(blob: Blob) -> int:
    return blob.cells
