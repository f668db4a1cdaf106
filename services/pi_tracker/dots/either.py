"""Dots that hang on a hand, or on nothing that is known: both are followed, the likelier is told.

A hand's posture says where dots that are hidden come out again. Where it is no hand that is filmed,
or one whose dots are named otherwise than they are, it cannot be where its dots are, and names them
wrongly for good: then each goes where it went (body/cloud.py). Both tell the likelihood of the same
patches, so they are compared as they are. Pure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from services.pi_tracker.dots.dot import Dot, Patch
from services.pi_tracker.dots.search import CLOUD, LIVE
from services.pi_tracker.dots.tracker import DotTracker

# A picture speaks against a hand by what a cloud is likelier, nats of each dot, less the first of
# these, and against a cloud by what a hand is, and the second. (36 clips of the tuning half of
# benchmarks/dots_pictures.py: at most .6 on average; plates, chains and grids of eight dots: 1.5 to
# 8, but for chains that a finger fits.)
_AHEAD, _BEHIND = 3.0, 0.5
# So much must speak against what is believed; no more is remembered. (On the same clips at most 9
# speak against a hand at once; 64 if 1 instead of 3 is the first above.)
_SURE = 30.0
# No first picture of a hand is further from one than this, nats, and what is further is told as a
# cloud until so much speaks for a hand. (On the same: at most 11; of plates 34 to 155.)
_MISFIT, _DOUBT = 20.0, 10.0
# Of all pictures of a recording on average, by the same figures: above what any hand costs; and of
# one whose first picture is no hand's, which needs little more.
_ON_AVERAGE = (1.5, 0.5)


class EitherTracker:
    """DotTracker's dots, live, of whichever body the pictures speak for."""

    def __init__(
        self,
        landmarks: Sequence[str],
        size_px: tuple[int, int],
        seeds: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self._hand = DotTracker(landmarks, size_px, seeds, LIVE)
        self._cloud = DotTracker(landmarks, size_px, seeds, CLOUD)
        # What speaks for a cloud, nats of each dot.
        self._ahead: float | None = None

    def step(self, patches: Sequence[Patch], time_s: float) -> dict[str, Dot]:
        """The dots of the next picture, by landmark; empty until tracking has started."""
        hand, cloud = self._hand.step(patches, time_s), self._cloud.step(patches, time_s)
        if self._ahead is not None:
            gained = (self._cloud.gained - self._hand.gained) / len(self._hand.names)
            gained -= _BEHIND if self._is_cloud else _AHEAD
            was_cloud = self._is_cloud
            self._ahead = min(max(self._ahead + gained, -_SURE), _SURE)
            if was_cloud != self._is_cloud:
                # What was decided is believed as firmly as what was before.
                self._ahead = _SURE if self._is_cloud else -_SURE
        elif self._hand.begun is not None:
            self._ahead = _DOUBT if self._hand.misfit > _MISFIT else -_SURE
        return cloud if self._is_cloud else hand

    @property
    def dot_area_px2(self) -> float:
        """How large a dot is that shows as a whole, 0 while it is unknown."""
        return self._told.dot_area_px2

    @property
    def names(self) -> tuple[str, ...]:
        """The landmarks that have a dot."""
        return self._hand.names

    @property
    def notes(self) -> list[str]:
        """What a person should know of the start; empty if all is well."""
        return self._hand.notes

    @property
    def _is_cloud(self) -> bool:
        return self._ahead is not None and self._ahead > 0.0

    @property
    def _told(self) -> DotTracker:
        return self._cloud if self._is_cloud else self._hand


def is_cloud(hand: DotTracker, cloud: DotTracker, pictures: int) -> bool:
    """Whether dots hang on no hand, after so many pictures since tracking started."""
    if not hand.names or pictures < 1:
        return False
    gained = (cloud.nats - hand.nats) / (len(hand.names) * pictures)
    return gained > _ON_AVERAGE[hand.misfit > _MISFIT]
