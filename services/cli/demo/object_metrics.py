"""Measures the objects of a running rig for `rhot demo`: how far off, how often ok, touched, held.

Pure. Errors are against the simulator's truth, of poses that are ok; a pose without truth before
and after it is counted only.
"""

from __future__ import annotations

from collections import deque

import msgspec
import numpy as np

from rhot.messages.objects import ObjectContacts, ObjectPose
from services.cli.demo.truths import KEPT, Truths

# Names come from the network; a demo has one object.
_MAX_OBJECTS = 16


class ObjectSummary(msgspec.Struct, frozen=True, kw_only=True):
    """One object over a run; None where nothing was measured.

    touches: how often a part of a hand began to touch it; grasps: how often a hand took it.
    """

    poses: int
    ok_share: float
    position_median_mm: float | None
    position_rms_mm: float | None
    touches: int
    grasps: int


class _Object:
    def __init__(self) -> None:
        self.poses = 0
        self.ok = 0
        self.squared_mm2: list[float] = []
        # (hand, part) and hand, with the stamp of their newest beginning.
        self.touching: dict[tuple[str, str], int] = {}
        self.holding: dict[str, int] = {}
        self.touches = 0
        self.grasps = 0


class ObjectMetrics:
    """Collects poses, contacts and truth as they arrive; stamps in ns on one clock."""

    def __init__(self, truths: Truths) -> None:
        self._truths = truths
        self._objects: dict[str, _Object] = {}
        # Poses that are newer than the newest truth.
        self._waiting: deque[ObjectPose] = deque(maxlen=KEPT)

    @property
    def poses(self) -> int:
        """Poses of all objects."""
        return sum(one.poses for one in self._objects.values())

    def add_pose(self, pose: ObjectPose) -> None:
        """Take in a pose; it is scored once there is a truth after it."""
        known = self._known(pose.object)
        if known is None:
            return
        known.poses += 1
        if pose.tracking == "ok" and pose.registered:
            known.ok += 1
            self._waiting.append(pose)

    def add_contacts(self, message: ObjectContacts) -> None:
        """Take in who touches and who holds; a beginning counts once."""
        known = self._known(message.object)
        if known is None:
            return
        for one in message.contacts:
            part = (one.hand, one.part)
            if one.touching and known.touching.get(part) != one.since_ns:
                known.touching[part] = one.since_ns
                known.touches += 1
        for grasp in message.grasps:
            if known.holding.get(grasp.hand) != grasp.since_ns:
                known.holding[grasp.hand] = grasp.since_ns
                known.grasps += 1

    def score(self) -> None:
        """Score the poses that waited for the truth that came."""
        while self._waiting and self._waiting[0].stamp_ns <= self._truths.newest_ns:
            self._score(self._waiting.popleft())

    def _score(self, pose: ObjectPose) -> None:
        found = self._truths.around(pose.stamp_ns)
        known = self._known(pose.object)
        if found is None or known is None:
            return
        objects = (found.before.objects.get(pose.object), found.after.objects.get(pose.object))
        if objects[0] is None or objects[1] is None:
            return
        a, b = (np.array(one.position_m) for one in objects if one is not None)
        off_mm = 1e3 * (np.array(pose.position_m) - (a + found.share * (b - a)))
        known.squared_mm2.append(float(np.sum(off_mm**2)))

    def summary(self) -> dict[str, ObjectSummary]:
        """All measurements so far, by object."""
        return {name: _summary(one) for name, one in sorted(self._objects.items())}

    def _known(self, name: str) -> _Object | None:
        if name not in self._objects and len(self._objects) < _MAX_OBJECTS:
            self._objects[name] = _Object()
        return self._objects.get(name)


def _summary(one: _Object) -> ObjectSummary:
    squared = one.squared_mm2
    return ObjectSummary(
        poses=one.poses,
        ok_share=round(one.ok / one.poses, 4) if one.poses else 0.0,
        position_median_mm=round(float(np.sqrt(np.median(squared))), 2) if squared else None,
        position_rms_mm=round(float(np.sqrt(np.mean(squared))), 2) if squared else None,
        touches=one.touches,
        grasps=one.grasps,
    )


def object_text(name: str, one: ObjectSummary) -> str:
    """One line of `rhot demo`'s summary."""
    off = ""
    if one.position_median_mm is not None:
        off = f", median {one.position_median_mm:.1f} mm, RMS {one.position_rms_mm:.1f} mm"
        off += " against the truth"
    touched = f"; touched {one.touches} times, held {one.grasps}" if one.touches else ""
    return f"{name:<12} {one.poses} poses, {100 * one.ok_share:.0f} % ok{off}{touched}"
