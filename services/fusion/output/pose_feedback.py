"""Poses on their way back from the solver, in the order of time instead of arrival. Pure.

Live, a pose arrives some milliseconds after its points went out, more on a busy machine; offline,
at once. Were each used as soon as it is there, the same recording would give other points each
time. So a pose counts for points from a fixed time after its own instant on, and what comes before
that waits: which pose an instant's points rest on depends on stamps alone, as long as solver and
network take no longer than that.
"""

from __future__ import annotations

from bisect import insort
from typing import Generic, Protocol, TypeVar

from rhot.hand import HandName

# A pose counts for points this much later than its own. From points to pose and back takes 2 to 3
# ms between real processes (median; 10 to 80 at most on two cores that eight others use too), and 2
# more until fusion looks at it. At 30 frames a second it is the pose of the instant before; one
# instant older costs 6 % of the RMS of a closing fist from pictures (1.14 -> 1.21 mm), two 14 %,
# where directions do not turn on (known_paint.py).
POSE_DELAY_NS = 25_000_000
# Poses that wait, at most; a rig has two hands, and some frames within the delay. Stamps come from
# the network: those of a far future must not fill the memory.
_WAITING = 64


class Told(Protocol):
    """A pose, or what is needed of one."""

    @property
    def hand(self) -> HandName: ...

    @property
    def stamp_ns(self) -> int: ...


T = TypeVar("T", bound=Told)


class PoseFeedback(Generic[T]):
    """The poses that have come, and do not count yet.

    late counts those that came after points which they should have counted for: these rest on an
    older pose, and are not what they would be offline.
    """

    def __init__(self) -> None:
        self.late = 0
        self._waiting: list[T] = []
        self._newest_ns: int | None = None

    def add(self, pose: T) -> None:
        """A pose has come, at whatever time."""
        if self._newest_ns is not None and pose.stamp_ns + POSE_DELAY_NS <= self._newest_ns:
            self.late += 1
        insort(self._waiting, pose, key=_order)
        # The farthest in the future.
        del self._waiting[_WAITING:]

    def take(self, instant_ns: int) -> list[T]:
        """The poses that count from now on, as points of this instant are due; oldest first."""
        self._newest_ns = instant_ns
        waiting, count = self._waiting, 0
        while count < len(waiting) and waiting[count].stamp_ns + POSE_DELAY_NS <= instant_ns:
            count += 1
        due = waiting[:count]
        del waiting[:count]
        return due

    def reset(self) -> None:
        """Time starts anew: what comes from before it is worth nothing."""
        self._waiting.clear()
        self._newest_ns = None


def _order(pose: Told) -> tuple[int, str]:
    return pose.stamp_ns, pose.hand
