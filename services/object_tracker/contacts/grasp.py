"""Whether a hand holds an object, and with which parts. Pure.

It does where the thumb or the palm and another part press from opposite sides: the line between
their points lies in both cones of friction, so that the two alone could hold it (Nguyen, IJRR 7(3),
1988). It does too where the object is touched and moves with the hand, as on a handle. When neither
is so any longer, the grasp is over.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array, angle_between, inverse
from rhot.hand_skin import SkinPart
from services.object_tracker.contacts.distances import PartDistance
from services.object_tracker.contacts.touch import TouchTracker

# Half the angle of a cone of friction: 45 deg are skin on plastic (coefficient 1), the rest the
# errors of points some millimetres off. Five fingers about a cup have pairs at 20 to 55 deg.
_CONE_COS = math.cos(math.radians(65.0))
# Less is a finger that slips by; and so long may opposition be missed without an end: two frames at
# 30 Hz.
_DWELL_S, _LINGER_S = 0.05, 0.08
# To move along: this far within that time; the noise of an object tracker is 1 mm and 0.3 deg.
_CARRY_S, _CARRY_M, _CARRY_RAD = 0.3, 0.012, math.radians(12.0)
# And to stay in the hand meanwhile: four times the noise of a wrist and its turn.
_SLIP_M, _SLIP_RAD = 0.006, math.radians(8.0)
# 0.3 s at 240 Hz are 72.
_MAX_MOTION = 128


class _Motion(NamedTuple):
    stamp_ns: int
    T_rig_from_object: Array  # (4, 4)
    T_rig_from_wrist: Array  # (4, 4)


class GraspTracker:
    """One hand and one object."""

    def __init__(self) -> None:
        self.since_ns = 0
        self.until_ns = 0
        self.began_ns = 0
        self.parts: tuple[SkinPart, ...] = ()
        self.carried = False
        self._motion: deque[_Motion] = deque(maxlen=_MAX_MOTION)
        self._holding_since_ns = 0
        self._held_at_ns = 0

    @property
    def holding(self) -> bool:
        """Whether there is a grasp now."""
        return self.since_ns > 0

    def step(
        self,
        stamp_ns: int,
        distances: list[PartDistance],
        touches: Mapping[SkinPart, TouchTracker],
        T_rig_from_object: Array,
        T_rig_from_wrist: Array,
    ) -> None:
        """The next instant, with the touches at it."""
        if self._motion and stamp_ns <= self._motion[-1].stamp_ns:
            self._motion.clear()
        self._motion.append(_Motion(stamp_ns, T_rig_from_object, T_rig_from_wrist))
        touching = {one.part: one for one in distances if touches[one.part].touching}
        self.carried = self._moves_along(stamp_ns) if touching else False
        pairs = opposed(touching)
        if pairs:
            since_ns = min(max(touches[a].since_ns, touches[b].since_ns) for a, b in pairs)
            if since_ns <= self.until_ns:
                # Parts that have just let go, and still touch, must oppose anew for as long.
                since_ns = stamp_ns
        else:
            since_ns = stamp_ns
        if not (pairs or (self.carried and touching)):
            self._holding_since_ns = 0
            self._maybe_end(stamp_ns, touches)
            return
        self._held_at_ns = stamp_ns
        self._holding_since_ns = self._holding_since_ns or since_ns
        if self.holding:
            self.parts = tuple(touching)
        elif stamp_ns - self._holding_since_ns >= _DWELL_S * 1e9:
            self.since_ns, self.parts = max(self._holding_since_ns, self.until_ns), tuple(touching)

    def end(self, stamp_ns: int) -> None:
        """Nothing is known any more: what was held no longer is, from stamp_ns on."""
        if self.holding:
            self.began_ns, self.until_ns, self.since_ns = self.since_ns, stamp_ns, 0
        self.carried = False
        self._holding_since_ns = 0
        self._motion.clear()

    def _maybe_end(self, stamp_ns: int, touches: Mapping[SkinPart, TouchTracker]) -> None:
        if not self.holding or stamp_ns - self._held_at_ns < _LINGER_S * 1e9:
            return
        # The hold broke when the first of its parts let go after it was last seen whole.
        let_go = [touches[part].until_ns for part in self.parts if not touches[part].touching]
        at_ns = min([one for one in let_go if one > self.since_ns], default=self._held_at_ns)
        self.began_ns, self.until_ns, self.since_ns = self.since_ns, at_ns, 0

    def _moves_along(self, stamp_ns: int) -> bool:
        """Whether the object has moved lately, and stayed where it is in the hand."""
        last = self._motion[-1]
        for first in self._motion:
            if stamp_ns - first.stamp_ns <= _CARRY_S * 1e9:
                break
        if stamp_ns - first.stamp_ns < 0.5 * _CARRY_S * 1e9:
            return False
        way, turn = _between(first.T_rig_from_object, last.T_rig_from_object)
        slip, twist = _between(
            inverse(first.T_rig_from_wrist) @ first.T_rig_from_object,
            inverse(last.T_rig_from_wrist) @ last.T_rig_from_object,
        )
        return (way > _CARRY_M or turn > _CARRY_RAD) and slip < _SLIP_M and twist < _SLIP_RAD


def opposed(touching: Mapping[SkinPart, PartDistance]) -> list[tuple[SkinPart, SkinPart]]:
    """The pairs of the thumb or the palm with another part that press against each other."""
    pairs: list[tuple[SkinPart, SkinPart]] = []
    for a, one in touching.items():
        for b, other in touching.items():
            if a not in ("thumb", "palm") or a == b or (a == "palm" and b == "thumb"):
                continue
            line = other.point_m - one.point_m
            length = float(np.linalg.norm(line))
            # Skin presses against the normal: from one point towards the other.
            if length > 0.0 and (
                -float(one.normal @ line) >= _CONE_COS * length
                and float(other.normal @ line) >= _CONE_COS * length
            ):
                pairs.append((a, b))
    return pairs


def _between(T_a: Array, T_b: Array) -> tuple[float, float]:
    """How far, and by which angle, b is from a."""
    way = float(np.linalg.norm(T_b[:3, 3] - T_a[:3, 3]))
    return way, angle_between(T_a[:3, :3], T_b[:3, :3])
