"""A blob from picture to picture: how far its edges have gone since it was first seen. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from services.pi_tracker.image.planes import Rect

# Cells along x and y.
Way = tuple[float, float]

# Set by what was seen in two clips of the other renderer, all of these, not swept. So far a hand or
# a blob must have gone along an axis, cells, to tell: half a marker's width.
_TOLD_CELLS = 6.0
# What stands still keeps one of its two edges across each axis to so many cells, whatever the hand
# covers or uncovers of it. (Of the axis of the hand's way alone: 11 of 984 dabs of a hard room lost
# for specks.) Both edges of what is carried along go this share of the hand's way, or more: fingers
# move by themselves, too.
_STILL_CELLS, _CARRIED_SHARE = 1, 0.5
# A blob is the one of the frame before when it is within so much of where that was, or of where the
# hand carried it, cells and share of the hand's way.
_SAME_CELLS, _SAME_SHARE = 4.0, 1.0
# A hand that nobody knows of may move by so much from picture to picture, cells (1.3 m/s at half a
# metre); a blob that does is as large as it was, but for this factor of its rectangle.
_FAR_CELLS, _ALIKE = 20.0, 2.5
# What is smaller may be noise.
LEAST_CELLS = 6


class FollowedBlob(NamedTuple):
    """Where a blob is; where it and the hand were when it was first seen, cells; frames since."""

    rect: Rect
    first: Rect
    hand_from: Way
    frames: int
    carried: bool | None  # what its way said last: it moved with a hand, or stood still; or nothing

    @property
    def stayed(self) -> bool:
        """Whether it stands where it was first seen."""
        return all(min(map(abs, edges)) <= _STILL_CELLS for edges in self._edges())

    @property
    def way(self) -> Way | None:
        """How far it has moved; None if too little to tell, or if only an edge of it did."""
        edges = self._edges()
        if not any(a * b > 0.0 and min(abs(a), abs(b)) >= _TOLD_CELLS for a, b in edges):
            return None
        (left, right), (top, bottom) = edges
        return 0.5 * (left + right), 0.5 * (top + bottom)

    def next(self, rect: Rect, hand: Way) -> FollowedBlob:
        """The same blob a frame later; hand: how far the hand has gone by then."""
        now = self._replace(rect=rect, frames=self.frames + 1)
        ways = hand[0] - self.hand_from[0], hand[1] - self.hand_from[1]
        axis = 0 if abs(ways[0]) >= abs(ways[1]) else 1
        stayed = now.stayed
        carried = self.carried if stayed or self.carried else None
        if abs(ways[axis]) >= _TOLD_CELLS:
            if stayed:
                carried = False
            elif min(edge / ways[axis] for edge in now._edges()[axis]) >= _CARRIED_SHARE:
                carried = True
        return now._replace(carried=carried)

    def _edges(self) -> tuple[Way, Way]:
        """How far the two edges across x have moved, and those across y."""
        x0, y0, x1, y1 = (now - then for now, then in zip(self.rect, self.first, strict=True))
        return (x0, x1), (y0, y1)


def followed(
    before: Sequence[FollowedBlob], rects: Sequence[Rect], moved: Way, hand: Way
) -> list[FollowedBlob]:
    """A colour's blobs, those that they were in the frame before, or new ones.

    moved: how far the hand went since that frame; hand: how far it has gone by now.
    """
    reach = _SAME_CELLS + _SAME_SHARE * math.hypot(*moved)
    found = [
        min(
            (one for one in before if _apart(rect, one.rect, moved) <= reach),
            key=lambda one: _apart(rect, one.rect, moved),
            default=None,
        )
        for rect in rects
    ]
    gone = [one for one in before if not any(one is known for known in found)]
    for n, rect in enumerate(rects):
        if found[n] is None and (far := _gone_to(rect, gone)) is not None:
            found[n] = far
            gone.remove(far)
    return [
        FollowedBlob(rect, rect, hand, 0, None) if one is None else one.next(rect, hand)
        for rect, one in zip(rects, found, strict=True)
    ]


def _gone_to(rect: Rect, gone: Sequence[FollowedBlob]) -> FollowedBlob | None:
    """Of those that are gone from where they were, the nearest that may be here now."""
    near = [
        (apart, n)
        for n, one in enumerate(gone)
        if (apart := _apart(rect, one.rect)) <= _FAR_CELLS and _alike(rect, one.rect)
    ]
    return gone[min(near)[1]] if near else None


def _apart(rect: Rect, before: Rect, moved: Way = (0.0, 0.0)) -> float:
    """How far a blob is from where one was, or from where the hand carried that, cells."""
    x, y = (0.5 * (rect[n] + rect[n + 2] - before[n] - before[n + 2]) for n in (0, 1))
    return min(math.hypot(x, y), math.hypot(x - moved[0], y - moved[1]))


def _alike(rect: Rect, other: Rect) -> bool:
    """Whether two rectangles are about as large, and larger than noise."""
    smaller, larger = sorted((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in (rect, other))
    return smaller >= LEAST_CELLS and larger <= _ALIKE * smaller
