"""Which of a colour's blobs stood still while the hand moved, and which were carried along. Pure.

A thing in a room may be as near to the other markers and as large as the marker that it is taken
for. It does not move with them. That a blob stands still says nothing by itself: a finger may lie
on a table while the others move. It does beside another blob of the colour that is carried along.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

from services.pi_tracker.identify.track import Track
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.planes import Rect

# Cells along x and y.
Way = tuple[float, float]

# Set by what was seen in two clips of the other renderer, all of these, not swept. So far the hand
# must have gone along an axis while a blob was followed, cells, to tell: half a marker's width.
_TOLD_CELLS = 6.0
# What stands still keeps one of its two edges across each axis to so many cells, whatever the hand
# covers or uncovers of it. (Of the axis of the hand's way alone: 11 of 984 dabs of a hard room lost
# for specks.) Both edges of what is carried along go this share of the hand's way, or more: fingers
# move by themselves, too.
_STILL_CELLS, _CARRIED_SHARE = 1, 0.5
# A blob is the one of the frame before when it is within so much of where that was, or of where the
# hand carried it, cells and share of the hand's way.
_SAME_CELLS, _SAME_SHARE = 4.0, 1.0
# So many markers whose blobs leave no choice tell how the hand moved.
_MARKERS = 3
# Frames farther apart say nothing of each other, ns.
_GAP_NS = 150_000_000
# Factor of the prior of what stands still beside what is carried along.
_STILL_FACTOR = 0.3


class _Followed(NamedTuple):
    """A blob's way: where it is, and where it and the hand were when it was first seen; cells."""

    rect: Rect
    first: Rect
    hand_from: Way
    carried: bool | None  # what its way said last, None: nothing yet

    def next(self, rect: Rect, hand: Way) -> _Followed:
        """The same blob a frame later."""
        ways = hand[0] - self.hand_from[0], hand[1] - self.hand_from[1]
        axis = 0 if abs(ways[0]) >= abs(ways[1]) else 1
        edges = [[rect[side] - self.first[side] for side in (n, n + 2)] for n in (0, 1)]
        stayed = all(min(map(abs, of)) <= _STILL_CELLS for of in edges)
        carried = self.carried if stayed or self.carried else None
        if abs(ways[axis]) >= _TOLD_CELLS:
            if stayed:
                carried = False
            elif min(edge / ways[axis] for edge in edges[axis]) >= _CARRIED_SHARE:
                carried = True
        return _Followed(rect, self.first, self.hand_from, carried)


class CarriedBlobs:
    """Follows the blobs of `count` colours while there is a choice between them."""

    def __init__(self, count: int) -> None:
        self._followed: list[list[_Followed]] = [[] for _ in range(count)]
        self._hand: Way = (0.0, 0.0)
        self._stamp_ns = 0

    def follow(
        self, blobs: Sequence[Sequence[Blob]], tracks: Sequence[Track | None], stamp_ns: int
    ) -> None:
        """Take in a frame's blobs of each colour, before they are compared."""
        ways = [
            (0.5 * (own[0].x_px - track.x_px), 0.5 * (own[0].y_px - track.y_px))
            for own, track in zip(blobs, tracks, strict=True)
            if len(own) == 1 and track is not None and track.seen_ns == track.stamp_ns
        ]
        recent = 0 < stamp_ns - self._stamp_ns <= _GAP_NS
        self._stamp_ns = stamp_ns
        known = self._followed
        if not recent or len(ways) < _MARKERS:
            known, ways = [[] for _ in blobs], [(0.0, 0.0)]
        x, y = (median(steps) for steps in zip(*ways, strict=True))
        self._hand = self._hand[0] + x, self._hand[1] + y
        self._followed = [
            [self._next(blob.rect, before, (x, y)) for blob in own]
            for own, before in zip(blobs, known, strict=True)
        ]

    def forget(self) -> None:
        """There was no choice."""
        for own in self._followed:
            own.clear()

    def prior_factors(self, color: int) -> list[float]:
        """Factors of the priors of a colour's blobs, in the order in which they were followed."""
        own = self._followed[color]
        if not any(one.carried for one in own):
            return [1.0] * len(own)
        return [_STILL_FACTOR if one.carried is False else 1.0 for one in own]

    def _next(self, rect: Rect, before: Sequence[_Followed], moved: Way) -> _Followed:
        reach = _SAME_CELLS + _SAME_SHARE * math.hypot(*moved)
        best, least = None, reach
        for one in before:
            x, y = (0.5 * (rect[n] + rect[n + 2] - one.rect[n] - one.rect[n + 2]) for n in (0, 1))
            apart = min(math.hypot(x, y), math.hypot(x - moved[0], y - moved[1]))
            if apart <= least:
                best, least = one, apart
        if best is None:
            return _Followed(rect, rect, self._hand, None)
        return best.next(rect, self._hand)
