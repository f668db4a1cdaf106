"""Data association: which of several blobs of one colour is the marker.

By size, shape and place relative to its track, and by consistency with the other markers. Pure. A
colour never seen takes the blob most consistent with the other markers; one lost for long may
reappear anywhere near them. A blob far from where the hand can be is refused: a marker is reported
missing rather than guessed. Static background is removed before (background.py).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from statistics import median
from typing import NamedTuple

from services.pi_tracker.identify.blob_prior import ACCEPT_LIKENESS, blob_priors
from services.pi_tracker.identify.blob_shape import touch
from services.pi_tracker.identify.carried_blobs import CarriedBlobs
from services.pi_tracker.identify.group_consistency import Candidate, most_consistent_set
from services.pi_tracker.identify.hand_layout import NO_LANDMARKS, HandLayout, Landmarks
from services.pi_tracker.identify.track import AREA_MEMORY, RECENT_NS, Track
from services.pi_tracker.image.blob import Blob

# Blobs whose score is below this (a perfect one has 1) are not the marker.
_MIN_SCORE = 0.25
# While another colour touches a marker, its remembered area follows with this weight of the old
# one: the area that is occluded should not be forgotten within a few frames.
_AREA_MEMORY_TOUCHED = 0.98
# Areas vary by less than this; what is missing beyond it is occluded where another colour touches.
# Where none does, it may be a finger that turns, but not by so much between two frames: then
# something without paint is in front.
_AREA_NOISE, _AREA_STEP = 0.15, 0.35
# So many blobs of a colour are compared with those of the others; the cost grows with the square.
# More is a room full of that colour.
_MAX_CANDIDATES = 16
# Weight of a blob that is not consistent with any other marker, against 1 of one that fully is.
_ISOLATED_WEIGHT = 0.1
# Factor of a prior where the blob has the colour of known things beside it, and may be a part of
# them that a hand uncovers: what is like its track is taken all the same, nothing else.
_ROOM_FACTOR = 0.5


class Association(NamedTuple):
    """The blob that is a colour's marker.

    certainty, 0..1, falls where a second blob is nearly as good; consistency, 0..1, where it is far
    from the other markers or of another size.
    """

    blob: Blob
    certainty: float
    consistency: float


class MarkerIdentity:
    """The tracks of colours, of which the layout may be known.

    Each frame: associate() blobs with colours, then update() each associated colour with its
    measured position.
    """

    def __init__(
        self, colors: Sequence[str], margin_px: float, landmarks: Landmarks = NO_LANDMARKS
    ) -> None:
        count = len(colors)
        self._layout = HandLayout(colors, landmarks)
        self._margin_px = margin_px
        self._tracks: list[Track | None] = [None] * count
        # Which of the markers associated last have another's paint beside them.
        self._touched = [False] * count
        self._carried = CarriedBlobs(count)

    def associate(
        self, blobs: list[list[Blob]], stamp_ns: int, like_room: Callable[[Blob], bool]
    ) -> list[Association | None]:
        """Each colour's marker, None where there is none.

        like_room: whether a blob has the colour of static background beside it.
        """
        associated = self._obvious(blobs, stamp_ns)
        if associated:
            self._carried.forget()
        else:
            associated = self._compared(blobs, stamp_ns, like_room)
        self._note_touching(associated)
        self._coast_unseen(associated, stamp_ns)
        return associated

    def _obvious(self, blobs: list[list[Blob]], stamp_ns: int) -> list[Association | None]:
        """Each colour's only blob, where every colour has one that is like its track; else none."""
        found: list[Association | None] = []
        for track, own in zip(self._tracks, blobs, strict=True):
            if len(own) != 1 or track is None:
                return []
            (blob,) = own
            like = track.likeness(blob, stamp_ns, self._margin_px) >= ACCEPT_LIKENESS
            if not like and not track.is_at(blob, stamp_ns):
                return []
            found.append(Association(blob, 1.0, 1.0))
        return found

    def _compared(
        self, blobs: list[list[Blob]], stamp_ns: int, like_room: Callable[[Blob], bool]
    ) -> list[Association | None]:
        """Each colour's marker, by its track and the other colours' blobs."""
        blobs = [self._preselected(color, own, stamp_ns) for color, own in enumerate(blobs)]
        self._carried.follow(blobs, self._tracks, stamp_ns)
        candidates = [
            self._candidates(color, blobs, stamp_ns, like_room) for color in range(len(blobs))
        ]
        if self.mistaken:
            self._forget_mistakes(candidates)
        best = most_consistent_set(candidates, self._layout)
        return [
            None if member is None else _accepted(candidates[color], *member)
            for color, member in enumerate(best)
        ]

    @property
    def mistaken(self) -> bool:
        """Whether it showed in this frame that things were taken for the hand."""
        return self._carried.mistaken

    @property
    def may_be_elsewhere(self) -> bool:
        """Whether a look at the whole next image may show that they are."""
        return self._carried.in_doubt

    def _forget_mistakes(self, candidates: list[list[Candidate]]) -> None:
        """Of the colours that did not show where the hand is, nothing is known; in place.

        The next frame has all their blobs (MarkerFinder forgets the room then).
        """
        for color, own in enumerate(candidates):
            if not self._carried.any_carried(color):
                self._tracks[color] = None
                own.clear()

    def update(
        self,
        color: int,
        x_px: float,
        y_px: float,
        area_px: float,
        found_px2: float,
        stamp_ns: int,
    ) -> float:
        """Take in a marker's measurement, and how large its blob was as it was found.

        Returns which fraction of it is occluded, 0..1.
        """
        track = self._tracks[color]
        if track is None:
            self._tracks[color] = Track(x_px, y_px, area_px, found_px2, stamp_ns)
            return 0.0
        missing = 1.0 - area_px / max(track.area_px, 1.0)
        touched = self._touched[color]
        area_memory = _AREA_MEMORY_TOUCHED if touched else AREA_MEMORY
        track.update(x_px, y_px, area_px, found_px2, stamp_ns, area_memory)
        return missing if missing > (_AREA_NOISE if touched else _AREA_STEP) else 0.0

    def predicted(
        self, color: int, stamp_ns: int, within_ns: int = RECENT_NS
    ) -> tuple[float, float] | None:
        """Predicted place, px, of a marker that was seen so lately; else None."""
        track = self._tracks[color]
        if track is None or not track.is_recent(stamp_ns, within_ns):
            return None
        return track.predicted(stamp_ns)

    def departure_px(self, color: int, x_px: float, y_px: float, stamp_ns: int) -> float:
        """How far a place is from where a marker was predicted; 0 if it was not seen lately."""
        predicted = self.predicted(color, stamp_ns)
        return 0.0 if predicted is None else math.dist(predicted, (x_px, y_px))

    def area_px2(self, color: int) -> float:
        """How large a marker was when it was seen, 0 if it never was."""
        track = self._tracks[color]
        return 0.0 if track is None else track.area_px

    def whole_px2(self, color: int) -> float:
        """How large a marker is where all of it shows, 0 if it never was seen."""
        track = self._tracks[color]
        return 0.0 if track is None else track.whole_px2

    def likeliest(self, color: int, own: list[Blob], stamp_ns: int) -> Blob:
        """Of a colour's blobs the one most like its track, or, without a track, the largest."""
        return own[0] if len(own) == 1 else max(own, key=self._rank(color, stamp_ns))

    def width_cells(self) -> float:
        """How wide the markers are that were seen, the median of them; 0 if there is none."""
        areas = [track.area_px for track in self._tracks if track is not None]
        return 0.5 * math.sqrt(median(areas)) if areas else 0.0

    def _others_px2(self, color: int) -> float:
        """How large the other colours' markers are, the median of them, 0 if none was seen."""
        others = (track for number, track in enumerate(self._tracks) if number != color)
        areas = [track.area_px for track in others if track is not None]
        return median(areas) if areas else 0.0

    def found_px2(self, color: int) -> float:
        """How large its blobs were as they were found, 0 if it never was."""
        track = self._tracks[color]
        return 0.0 if track is None else track.found_px2

    def _preselected(self, color: int, own: list[Blob], stamp_ns: int) -> list[Blob]:
        """The blobs of a colour to compare with all others.

        Those most like its track, or, without a track, the largest.
        """
        if len(own) <= _MAX_CANDIDATES:
            return own
        return sorted(own, key=self._rank(color, stamp_ns), reverse=True)[:_MAX_CANDIDATES]

    def _rank(self, color: int, stamp_ns: int) -> Callable[[Blob], float]:
        track = self._tracks[color]
        if track is None:
            return lambda blob: blob.cells
        return lambda blob: track.likeness(blob, stamp_ns, self._margin_px)

    def _note_touching(self, associated: list[Association | None]) -> None:
        self._touched = [False] * len(associated)
        seen = [(color, one.blob.rect) for color, one in enumerate(associated) if one is not None]
        for (color, rect), (other, other_rect) in itertools.combinations(seen, 2):
            if touch(rect, other_rect):
                self._touched[color] = self._touched[other] = True

    def _coast_unseen(self, associated: list[Association | None], stamp_ns: int) -> None:
        """Move the tracks that are not seen with the median motion of those that are."""
        if None not in associated:
            return
        moved = [
            (one.blob, track)
            for one, track in zip(associated, self._tracks, strict=True)
            if one is not None and track is not None and track.stamp_ns < stamp_ns
        ]
        if not moved:
            return
        moved_px = (
            median(blob.x_px - track.x_px for blob, track in moved),
            median(blob.y_px - track.y_px for blob, track in moved),
        )
        before_px_s = (
            median(track.vx_px_s for _, track in moved),
            median(track.vy_px_s for _, track in moved),
        )
        for one, track in zip(associated, self._tracks, strict=True):
            if one is None and track is not None:
                track.coast(moved_px, before_px_s, stamp_ns)

    def _candidates(
        self,
        color: int,
        blobs: list[list[Blob]],
        stamp_ns: int,
        like_room: Callable[[Blob], bool],
    ) -> list[Candidate]:
        """The blobs of a colour with their priors."""
        own = blobs[color]
        track = self._tracks[color]
        others_px2 = self._others_px2(color)
        priors = blob_priors(color, blobs, track, stamp_ns, self._margin_px, others_px2)
        factors = self._carried.prior_factors(color)
        priors = [
            prior * factor * (_ROOM_FACTOR if like_room(blob) else 1.0)
            for blob, prior, factor in zip(own, priors, factors, strict=True)
        ]
        if track is None:
            return [Candidate(blob, prior) for blob, prior in zip(own, priors, strict=True)]
        partly_occluded = [
            track.is_at(blob, stamp_ns) and blob.area_px < track.area_px for blob in own
        ]
        return [
            Candidate(blob, prior, track.area_px if partly else 0.0)
            for blob, prior, partly in zip(own, priors, partly_occluded, strict=True)
        ]


def _accepted(own: list[Candidate], member: Candidate, consistency: float) -> Association | None:
    """The association of a set's member, None if its score is too low."""
    score = member.prior * (_ISOLATED_WEIGHT + (1.0 - _ISOLATED_WEIGHT) * consistency)
    if score < _MIN_SCORE:
        return None
    second = max((candidate.prior for candidate in own if candidate is not member), default=0.0)
    certainty = 1.0 - 0.5 * min(1.0, second / member.prior)
    return Association(member.blob, certainty, consistency)
