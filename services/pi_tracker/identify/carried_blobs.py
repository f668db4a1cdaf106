"""Which of a colour's blobs stood still while the hand moved, and which were carried along. Pure.

A thing in a room may be as near to the other markers and as large as the marker that it is taken
for. It does not move with them. That a blob stands still says nothing by itself: a finger may lie
on a table while the others move. It does beside another blob of the colour that is carried along.

Things may be taken for most of a hand, or all of it. Then nothing that is taken for the hand moves,
and in several colours something else does: that is the hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from services.pi_tracker.identify.followed_blob import LEAST_CELLS, FollowedBlob, Way, followed
from services.pi_tracker.identify.track import Track
from services.pi_tracker.image.blob import Blob

# So many markers tell how the hand moved, those whose blobs leave no choice if there are as many:
# of several, the one that was taken may be a thing. (A tuning clip of the other renderer, flapping
# at 1 Hz before green stripes: with all of them 63 of 240 green tips were not found in one camera,
# and 7 on a stripe.) And so many colours, where the hand is if it is elsewhere.
_MARKERS = 3
# What is smaller, cells, or was followed for fewer frames, may be noise that seems to move. (A hand
# at rest in a noisy room: 99 % of its markers found from two frames on, 91 with none.)
_SURE_FRAMES = 3
# Frames farther apart say nothing of each other, ns.
_GAP_NS = 150_000_000
# Factor of the prior of what stands still beside what is carried along.
_STILL_FACTOR = 0.3


class CarriedBlobs:
    """Follows the blobs of `count` colours while there is a choice between them.

    mistaken: until this frame, things were taken for the hand. in_doubt: nothing that is taken for
    it moves, and in several colours there is something else.
    """

    def __init__(self, count: int) -> None:
        self.mistaken = self.in_doubt = False
        self._followed: list[list[FollowedBlob]] = [[] for _ in range(count)]
        self._hand: Way = (0.0, 0.0)
        self._stamp_ns = 0

    def follow(
        self, blobs: Sequence[Sequence[Blob]], tracks: Sequence[Track | None], stamp_ns: int
    ) -> None:
        """Take in a frame's blobs of each colour, before they are compared."""
        taken = [
            _nearest(own, track) if track is not None and track.seen_ns == track.stamp_ns else None
            for own, track in zip(blobs, tracks, strict=True)
        ]
        ways = [
            (0.5 * (own[n].x_px - track.x_px), 0.5 * (own[n].y_px - track.y_px))
            for own, track, n in zip(blobs, tracks, taken, strict=True)
            if track is not None and n is not None
        ]
        choices = [len(own) for own, n in zip(blobs, taken, strict=True) if n is not None]
        single = [way for way, count in zip(ways, choices, strict=True) if count == 1]
        ways = single if len(single) >= _MARKERS else ways
        recent = 0 < stamp_ns - self._stamp_ns <= _GAP_NS
        self._stamp_ns = stamp_ns
        known = self._followed
        if not recent or len(ways) < _MARKERS:
            known, ways = [[] for _ in blobs], [(0.0, 0.0)]
        x, y = (median(steps) for steps in zip(*ways, strict=True))
        self._hand = self._hand[0] + x, self._hand[1] + y
        self._followed = [
            followed(before, [blob.rect for blob in own], (x, y), self._hand)
            for own, before in zip(blobs, known, strict=True)
        ]
        self._note_hand_elsewhere(blobs, taken)

    def forget(self) -> None:
        """There was no choice."""
        self.mistaken = self.in_doubt = False
        for own in self._followed:
            own.clear()

    def any_carried(self, color: int) -> bool:
        """Whether one of a colour's blobs is carried along."""
        return any(one.carried for one in self._followed[color])

    def prior_factors(self, color: int) -> list[float]:
        """Factors of the priors of a colour's blobs, in the order in which they were followed."""
        own = self._followed[color]
        if not self.any_carried(color):
            return [1.0] * len(own)
        return [_STILL_FACTOR if one.carried is False else 1.0 for one in own]

    def _note_hand_elsewhere(
        self, blobs: Sequence[Sequence[Blob]], taken: Sequence[int | None]
    ) -> None:
        """Where those taken (their index, of each colour) stand still, and others move together."""
        self.mistaken = False
        # Of colours whose taken blob stood still, the ways of the others, by their index.
        others: dict[int, dict[int, Way]] = {}
        moving = 0
        for color, (own, ones, n) in enumerate(zip(blobs, self._followed, taken, strict=True)):
            if n is None:
                continue
            moving += ones[n].way is not None
            if ones[n].stayed:
                ways = {k: one.way for k, one in enumerate(ones)}
                others[color] = {
                    k: way
                    for k, way in ways.items()
                    if way is not None
                    and own[k].cells >= LEAST_CELLS
                    and ones[k].frames >= _SURE_FRAMES
                }
        choices = sum(len(blobs[color]) > 1 for color in others)
        self.in_doubt = not moving and choices >= _MARKERS
        found = [way for ways in others.values() for way in ways.values()]
        if not found:
            return
        x, y = (median(steps) for steps in zip(*found, strict=True))
        together = {
            color: alike
            for color, ways in others.items()
            if (alike := {k for k, way in ways.items() if way[0] * x + way[1] * y > 0.0})
        }
        if len(together) < max(_MARKERS, moving + 1):
            return
        for color, alike in together.items():
            self.mistaken |= not self.any_carried(color)
            self._followed[color] = [
                one._replace(carried=True if k in alike else False if one.stayed else one.carried)
                for k, one in enumerate(self._followed[color])
            ]


def _nearest(own: Sequence[Blob], track: Track) -> int | None:
    """The index of the blob that is nearest to a track; None if there is none."""

    def apart(n: int) -> float:
        return (own[n].x_px - track.x_px) ** 2 + (own[n].y_px - track.y_px) ** 2

    return min(range(len(own)), key=apart, default=None)
