"""The last poses of one object, so that it is known at the instant of a hand's pose. Pure."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

from rhot.messages.objects import ObjectPose
from rhot.object_motion import HORIZON_NS, between, predict

# 0.5 s: a hand's pose comes at most some frames after its pictures. 512 poses are 0.5 s at 1 kHz,
# the fastest source that rig.toml allows.
_KEPT_NS = 500_000_000
_MAX_POSES = 512


class ObjectHistory:
    """Half a second of ObjectPose of one object, by their stamps."""

    def __init__(self, horizon_ns: int = HORIZON_NS) -> None:
        """horizon_ns: how far a pose is carried on, and the longest gap that is bridged."""
        self._horizon_ns = horizon_ns
        self._poses: list[ObjectPose] = []
        self._stamps: list[int] = []

    def add(self, pose: ObjectPose) -> None:
        """The next pose. One that is older than the last begins a new history: time was set."""
        if self._stamps and pose.stamp_ns < self._stamps[-1]:
            self._poses.clear()
            self._stamps.clear()
        self._poses.append(pose)
        self._stamps.append(pose.stamp_ns)
        # Emptied by halves: a list that loses its first element at every pose moves all the others.
        if len(self._stamps) >= 2 * _MAX_POSES or (
            len(self._stamps) % 64 == 0 and pose.stamp_ns - self._stamps[0] > 2 * _KEPT_NS
        ):
            old = bisect_left(self._stamps, pose.stamp_ns - _KEPT_NS)
            old = max(old, len(self._stamps) - _MAX_POSES)
            del self._poses[:old], self._stamps[:old]

    @property
    def newest(self) -> ObjectPose | None:
        """The last pose added."""
        return self._poses[-1] if self._poses else None

    def at(self, stamp_ns: int) -> ObjectPose | None:
        """The object at that instant: interpolated inside, predicted after the newest pose.

        None before the oldest pose, further than the horizon from the next earlier pose, and
        wherever the object is lost; its `tracking` and `registered` are to be looked at as those of
        a message are.
        """
        after = bisect_right(self._stamps, stamp_ns)
        if after == 0:
            return None
        before = self._poses[after - 1]
        if before.tracking == "lost" or stamp_ns - before.stamp_ns > self._horizon_ns:
            return None
        if before.stamp_ns == stamp_ns:
            return before
        if after < len(self._poses):
            following = self._poses[after]
            if (
                following.tracking != "lost"
                and following.registered == before.registered
                and following.stamp_ns - before.stamp_ns <= self._horizon_ns
            ):
                return between(before, following, stamp_ns)
        return predict(before, stamp_ns, self._horizon_ns)
