"""A blob from picture to picture: how far its edges have gone since it was first seen. Pure."""

from __future__ import annotations

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


class FollowedBlob(NamedTuple):
    """Where a blob is, and where it and the hand were when it was first seen; cells."""

    rect: Rect
    first: Rect
    hand_from: Way
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
        now = self._replace(rect=rect)
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
