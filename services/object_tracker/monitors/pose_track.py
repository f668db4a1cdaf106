"""Where an object was at an instant of the last seconds. Pure."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque

from rhot.geometry.transforms import (
    Array,
    inverse,
    rotation_from_vector,
    transform,
    vector_from_rotation,
)

# Four seconds at 250 Hz.
_MAX_POSES = 1000
# SteamVR reports at 90 Hz at least; over a longer gap a hand may have turned round.
_MAX_GAP_NS = 60_000_000


class PoseTrack:
    """The newest poses of one object, in order of their instants; late ones are left out."""

    def __init__(self) -> None:
        self._instants_ns: deque[int] = deque(maxlen=_MAX_POSES)
        self._poses: deque[Array] = deque(maxlen=_MAX_POSES)

    def add(self, instant_ns: int, T: Array) -> None:
        """A pose (4, 4)."""
        if self._instants_ns and instant_ns <= self._instants_ns[-1]:
            # A clock that was set back: begin anew.
            if self._instants_ns[-1] - instant_ns < 1_000_000_000:
                return
            self._instants_ns.clear()
            self._poses.clear()
        self._instants_ns.append(instant_ns)
        self._poses.append(T)

    def at(self, instant_ns: int) -> Array | None:
        """The pose (4, 4), between its two neighbours; None without them."""
        after = bisect_left(self._instants_ns, instant_ns)
        if not 0 < after < len(self._instants_ns):
            return None
        before_ns, after_ns = self._instants_ns[after - 1], self._instants_ns[after]
        if after_ns - before_ns > _MAX_GAP_NS:
            return None
        share = (instant_ns - before_ns) / (after_ns - before_ns)
        a, b = self._poses[after - 1], self._poses[after]
        turn = share * vector_from_rotation((inverse(a) @ b)[:3, :3])
        position_m = (1.0 - share) * a[:3, 3] + share * b[:3, 3]
        return transform(a[:3, :3] @ rotation_from_vector(turn), position_m)
