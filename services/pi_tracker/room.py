"""What of a marker's colour stands in the room: blobs that stay where they are while the marker is elsewhere.

Pure. Nothing is known at the start; a thing that is put into the room is known after a few frames, one that is taken away is
forgotten. A hand that lies still is not taken for furniture: only blobs that were not the marker are learnt.
"""

from __future__ import annotations

from dataclasses import dataclass

from services.pi_tracker.planes import Rect
from services.pi_tracker.search import Blob

# Sightings at one place before a blob counts as standing there: a tenth of a second at 30 fps, too long for a moving finger.
_SIGHTINGS = 4
# Noise moves the edges of a still blob by this many cells.
_STILL_CELLS = 2
# A thing not seen for so long has gone, or is hidden for good.
_FORGET_NS = 60_000_000_000
# Things remembered per colour; the least seen makes room.
_MAX_THINGS = 12


@dataclass
class _Thing:
    rect: Rect
    sightings: int
    seen_ns: int


class Room:
    """Standing things of one colour."""

    def __init__(self) -> None:
        self._things: list[_Thing] = []

    def holds(self, blob: Blob) -> bool:
        """Whether a blob is a standing thing, or the part of one that a hand leaves to see."""
        return any(thing.sightings >= _SIGHTINGS and _within(blob.rect, thing.rect) for thing in self._things)

    def learn(self, blob: Blob, stamp_ns: int) -> None:
        """Take in a blob that is not the marker."""
        for thing in self._things:
            if _same(blob.rect, thing.rect):
                thing.sightings += 1
                thing.seen_ns = stamp_ns
                return
        self._things = [thing for thing in self._things if 0 <= stamp_ns - thing.seen_ns < _FORGET_NS]
        if len(self._things) >= _MAX_THINGS:
            self._things.remove(min(self._things, key=lambda thing: thing.sightings))
        self._things.append(_Thing(blob.rect, 1, stamp_ns))


def _same(a: Rect, b: Rect) -> bool:
    return all(abs(p - q) <= _STILL_CELLS for p, q in zip(a, b, strict=True))


def _within(a: Rect, b: Rect) -> bool:
    slack = _STILL_CELLS
    return a[0] >= b[0] - slack and a[1] >= b[1] - slack and a[2] <= b[2] + slack and a[3] <= b[3] + slack
