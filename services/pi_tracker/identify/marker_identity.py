"""Which of several blobs of one colour is the marker: plausibility by size, shape, jump and
company.

Pure. A colour never seen takes the blob that fits the other markers best; one lost for long may
reappear anywhere near them. A blob that is far from where the hand can be is refused: a marker is
reported missing rather than guessed. What stands in the room does not come here (room.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

from services.pi_tracker.detect.blob_search import Blob
from services.pi_tracker.identify.group_consistency import Candidate, best_set
from services.pi_tracker.image.yuv_planes import Rect

# A hand at arm's length moves 2 m/s when it is fast: at 0.5 m and f = 527 px that is 2100 px/s.
_FASTEST_PX_S = 2100.0
# Paint patches seen from any side, blurred by fast motion, stay within this ratio of sides and fill
# this share of their box.
_MAX_ASPECT, _MIN_FILL = 6.0, 0.3
# Blobs less likely than this against a perfect one are not the marker.
_LEAST = 0.25
# A remembered area follows the marker with this share of the old one per frame.
_AREA_KEEP = 0.8
# ... while another colour touches it, with this share: what is hidden of it should not be forgotten
# within a few frames.
_AREA_KEEP_TOUCHED = 0.98
# Areas vary by less than this; what is missing beyond it is hidden where another colour touches.
# Where none does, it may be a finger that turns, but not by so much between two frames: then
# something without paint is in front.
_AREA_NOISE, _AREA_STEP = 0.15, 0.35
# So many blobs of a colour are compared with those of the others; the cost grows with the square.
# More is a room full of that colour.
_MOST = 16
# What company counts against having none at all.
_ALONE = 0.1
# A blob as like its own track as this, and the only one of its colour, is the marker without asking
# the others.
_SURE = 0.6
# However unlike its track, a blob in good company may be the marker after all: the track may have
# been wrong.
_SECOND_THOUGHT = 0.4
# No marker shrinks to such a share of its size within so long; what does is noise, or something
# pale that a dim light brings near.
_SHRUNK, _SHRUNK_NS, _NOISE = 1.0 / 16.0, 5_000_000_000, 0.1
# A track that moves less than this a frame stands still, and after so many frames may be no marker.
_STILL_PX, _STANDING = 1.0, 4
# A small blob at the rim of a larger one of another colour is, as a rule, that one's edge in
# coloured light: so much less likely a marker, when it is at most this share of the other's size.
_HALO, _HALO_SHARE = 0.3, 0.6
# ... unless it is within so many pixels of where the marker must be by now: half hidden behind the
# other. In the simulator's hard scene, 95 % of 427 such markers were within 21 px of it, and no
# mere edge was. While it is hidden the finger moves on, by so much more.
_THERE_PX, _THERE_PX_S, _LATELY_NS = 20.0, 40.0, 300_000_000


@dataclass
class Track:
    """What is known of one colour's marker: its place and speed at stamp_ns, measured, or carried
    on since seen_ns.
    """

    x_px: float
    y_px: float
    area_px: float
    stamp_ns: int
    vx_px_s: float = 0.0
    vy_px_s: float = 0.0
    # Frames in a row in which it has not moved.
    still: int = 0
    seen_ns: int = -1

    def __post_init__(self) -> None:
        self.seen_ns = self.stamp_ns

    def predicted(self, stamp_ns: int) -> tuple[float, float]:
        """Where it should be; velocity is trusted for a tenth of a second."""
        ahead_s = min(max((stamp_ns - self.stamp_ns) * 1e-9, 0.0), 0.1)
        return self.x_px + self.vx_px_s * ahead_s, self.y_px + self.vy_px_s * ahead_s

    def follow(
        self, x_px: float, y_px: float, area_px: float, stamp_ns: int, area_keep: float = _AREA_KEEP
    ) -> None:
        """Take in the marker's new place."""
        self.still = (
            self.still + 1 if abs(x_px - self.x_px) + abs(y_px - self.y_px) < _STILL_PX else 0
        )
        self._move(x_px, y_px, stamp_ns)
        self.area_px = area_keep * self.area_px + (1.0 - area_keep) * area_px
        self.seen_ns = stamp_ns

    def carry(self, dx_px: float, dy_px: float, stamp_ns: int) -> None:
        """It was not seen; the hand moved so far."""
        self._move(self.x_px + dx_px, self.y_px + dy_px, stamp_ns)

    def _move(self, x_px: float, y_px: float, stamp_ns: int) -> None:
        elapsed_s = (stamp_ns - self.stamp_ns) * 1e-9
        # After a longer gap, or with stamps that do not advance, the old place tells nothing of the
        # speed.
        if 0.0 < elapsed_s < 0.1:
            self.vx_px_s, self.vy_px_s = (
                (x_px - self.x_px) / elapsed_s,
                (y_px - self.y_px) / elapsed_s,
            )
        else:
            self.vx_px_s = self.vy_px_s = 0.0
        self.x_px, self.y_px, self.stamp_ns = x_px, y_px, stamp_ns

    def likeness(self, blob: Blob, stamp_ns: int, margin_px: float) -> float:
        """How much a blob is like this marker by place and size, 0..1."""
        x, y = self.predicted(stamp_ns)
        dx, dy = blob.x_px - x, blob.y_px - y
        gap_s = min(max((stamp_ns - self.seen_ns) * 1e-9, 0.0), 1.0)
        reach = margin_px + _FASTEST_PX_S * gap_s
        size = min(blob.area_px, self.area_px) / max(blob.area_px, self.area_px, 1.0)
        return float(size**0.5 / (1.0 + (dx * dx + dy * dy) / (reach * reach)))

    def is_recent(self, stamp_ns: int) -> bool:
        """Whether it was seen a moment ago."""
        return 0 <= stamp_ns - self.seen_ns <= _LATELY_NS

    def is_at(self, blob: Blob, stamp_ns: int) -> bool:
        """Whether a blob is where this marker, seen a moment ago, must be."""
        gap_ns = stamp_ns - self.seen_ns
        x, y = self.predicted(stamp_ns)
        return (
            self.is_recent(stamp_ns)
            and max(abs(blob.x_px - x), abs(blob.y_px - y))
            <= _THERE_PX + _THERE_PX_S * gap_ns * 1e-9
        )


def shape_fits(blob: Blob, max_area_px: float) -> bool:
    """Whether a blob may be a patch of paint at all."""
    width, height = blob.rect[2] - blob.rect[0], blob.rect[3] - blob.rect[1]
    return (
        blob.area_px <= max_area_px
        and max(width, height) <= _MAX_ASPECT * min(width, height)
        and blob.cells >= _MIN_FILL * width * height
    )


@dataclass(frozen=True, eq=False)
class Choice:
    """A marker's blob.

    Certainty 0..1 falls where a second blob is nearly as good, support 0..1 where it is far from
    the other markers.
    """

    blob: Blob
    certainty: float
    support: float


def is_halo(blob: Blob, other: Blob) -> bool:
    """Whether a blob touches a larger one of another colour."""
    return blob.cells <= _HALO_SHARE * other.cells and touch(blob.rect, other.rect)


def touch(a: Rect, b: Rect) -> bool:
    """Whether two rectangles of cells overlap or lie next to each other, but for a cell."""
    return a[0] <= b[2] + 1 and b[0] <= a[2] + 1 and a[1] <= b[3] + 1 and b[1] <= a[3] + 1


class Identity:
    """Tracks of `count` colours."""

    def __init__(self, count: int, margin_px: float) -> None:
        self._margin_px = margin_px
        self._tracks: list[Track | None] = [None] * count
        # Which of the markers chosen last have another's paint beside them.
        self._touched = [False] * count

    def choose(self, blobs: list[list[Blob]], stamp_ns: int) -> list[Choice | None]:
        """Each colour's marker, None where there is none."""
        blobs = [self._likely(color, own, stamp_ns) for color, own in enumerate(blobs)]
        candidates = [self._candidates(color, blobs, stamp_ns) for color in range(len(blobs))]
        chosen: list[Choice | None]
        if all(
            len(own) == 1 and own[0].prior >= _SURE and self._tracks[color] is not None
            for color, own in enumerate(candidates)
        ):
            chosen = [Choice(own[0].blob, 1.0, 1.0) for own in candidates]
        else:
            best = best_set(candidates)
            chosen = [
                None if member is None else self._choice(candidates[color], *member)
                for color, member in enumerate(best)
            ]
        rects = [None if choice is None else choice.blob.rect for choice in chosen]
        for color, rect in enumerate(rects):
            self._touched[color] = rect is not None and any(
                other is not None and number != color and touch(rect, other)
                for number, other in enumerate(rects)
            )
        self._carry(chosen, stamp_ns)
        return chosen

    def _likely(self, color: int, own: list[Blob], stamp_ns: int) -> list[Blob]:
        """The blobs of a colour that are worth comparing with all others: those most like its
        track, or else the largest.
        """
        if len(own) <= _MOST:
            return own
        track = self._tracks[color]
        rank = (
            (lambda blob: blob.cells)
            if track is None
            else (lambda blob: track.likeness(blob, stamp_ns, self._margin_px))
        )
        return sorted(own, key=rank, reverse=True)[:_MOST]

    def expected(self, color: int, stamp_ns: int) -> tuple[float, float] | None:
        """Where a marker must be that was seen a moment ago, px."""
        track = self._tracks[color]
        return (
            track.predicted(stamp_ns) if track is not None and track.is_recent(stamp_ns) else None
        )

    def area_px2(self, color: int) -> float:
        """How large a marker was when it was seen, 0 if it never was."""
        track = self._tracks[color]
        return 0.0 if track is None else track.area_px

    def _carry(self, chosen: list[Choice | None], stamp_ns: int) -> None:
        """Markers that are not seen move as the others do."""
        moved = [
            (choice.blob.x_px - track.x_px, choice.blob.y_px - track.y_px)
            for choice, track in zip(chosen, self._tracks, strict=True)
            if choice is not None and track is not None and track.stamp_ns < stamp_ns
        ]
        if not moved or len(moved) == len(chosen):
            return
        dx, dy = (median(steps) for steps in zip(*moved, strict=True))
        for choice, track in zip(chosen, self._tracks, strict=True):
            if choice is None and track is not None:
                track.carry(dx, dy, stamp_ns)

    def follow(self, color: int, x_px: float, y_px: float, area_px: float, stamp_ns: int) -> float:
        """Take in a marker that was measured; says which share of it is hidden, 0..1."""
        track = self._tracks[color]
        if track is None:
            self._tracks[color] = Track(x_px, y_px, area_px, stamp_ns)
            return 0.0
        missing = 1.0 - area_px / max(track.area_px, 1.0)
        touched = self._touched[color]
        track.follow(x_px, y_px, area_px, stamp_ns, _AREA_KEEP_TOUCHED if touched else _AREA_KEEP)
        return missing if missing > (_AREA_NOISE if touched else _AREA_STEP) else 0.0

    def _candidates(self, color: int, blobs: list[list[Blob]], stamp_ns: int) -> list[Candidate]:
        own = blobs[color]
        priors = [self._prior(color, blob, blobs, stamp_ns) for blob in own]
        track = self._tracks[color]
        if len(own) > 1 and track is not None and track.still >= _STANDING:
            # What has not moved for a while may be a thing in the room; among others it has no
            # advantage.
            priors = [min(prior, _SECOND_THOUGHT) for prior in priors]
        hidden = [
            track is not None and track.is_at(blob, stamp_ns) and blob.area_px < track.area_px
            for blob in own
        ]
        whole_px2 = 0.0 if track is None else track.area_px
        return [
            Candidate(blob, prior, whole_px2 * part)
            for blob, prior, part in zip(own, priors, hidden, strict=True)
        ]

    def _prior(self, color: int, blob: Blob, blobs: list[list[Blob]], stamp_ns: int) -> float:
        track = self._tracks[color]
        likeness = 0.0 if track is None else track.likeness(blob, stamp_ns, self._margin_px)
        if likeness >= _SURE:
            return likeness
        prior = 1.0 if track is None else max(likeness, _SECOND_THOUGHT)
        if track is not None and track.is_at(blob, stamp_ns):
            return max(prior, _SURE)
        if (
            track is not None
            and blob.area_px < _SHRUNK * track.area_px
            and 0 <= stamp_ns - track.seen_ns <= _SHRUNK_NS
        ):
            return _NOISE
        halo = any(
            is_halo(blob, other)
            for number, others in enumerate(blobs)
            if number != color
            for other in others
        )
        return prior * _HALO if halo else prior

    @staticmethod
    def _choice(own: list[Candidate], member: Candidate, support: float) -> Choice | None:
        score = member.prior * (_ALONE + (1.0 - _ALONE) * support)
        if score < _LEAST:
            return None
        second = max((candidate.prior for candidate in own if candidate is not member), default=0.0)
        return Choice(member.blob, 1.0 - 0.5 * min(1.0, second / member.prior), support)
