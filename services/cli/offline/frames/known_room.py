"""A recording's room, known from its first picture on: its beginning is gone through twice.

The tracker learns what stands still while a hand moves. Live it cannot know that at once, and may
take a poster for the hand for a second, or for as long as the hand rests before it. Of a recording
it may see what comes first: the first seconds backwards, and then all from the first picture on.
Backwards, so that what is followed is where it was when the recording begins.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain

from services.pi_tracker.image.frame import Frame
from services.pi_tracker.step import TrackerStep

# How much of a recording is seen first, and how much memory its pictures may take. Set by hand:
# rooms that nobody arranged (benchmarks/rooms.py) were tried with all of their three seconds.
_SECONDS, _MOST_BYTES = 6.0, 192_000_000


def with_known_room(frames: Iterable[Frame], tracker: TrackerStep) -> Iterator[Frame]:
    """The same frames of one camera, while its tracker gets to know the room before the first.

    The tracker must not have seen any.
    """
    coming = iter(frames)
    beginning = _beginning(coming) if tracker.learns_room else []
    for frame in reversed(beginning[1:]):
        # As if time had run up to the first picture.
        tracker.step(replace(frame, stamp_ns=2 * beginning[0].stamp_ns - frame.stamp_ns))
    yield from chain(beginning, coming)


def _beginning(coming: Iterator[Frame]) -> list[Frame]:
    """The first seconds, or as much of them as there is room for; taken off what is coming."""
    found: list[Frame] = []
    taken = 0
    for frame in coming:
        found.append(frame)
        taken += frame.image.nbytes
        if frame.stamp_ns - found[0].stamp_ns >= 1e9 * _SECONDS or taken >= _MOST_BYTES:
            break
    return found
