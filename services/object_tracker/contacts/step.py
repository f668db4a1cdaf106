"""Hands and objects in, who touches what and who holds it out. Pure.

For each HandPose one ObjectContacts of each object that has a shape and has been seen in the rig
frame. Where an object or a hand is lost its distances are not told; its touches and grasps stay for
half a second, then they end. A finger that is only predicted begins no touch, and ends none for as
long.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rhot.contact_events import KEPT_NS
from rhot.files.config import RigConfig
from rhot.files.shapes import solid_of
from rhot.geometry.solids import Solid
from rhot.geometry.transforms import Array, rotation_from_quaternion, transform
from rhot.hand import HandName
from rhot.hand_skin import PARTS
from rhot.messages import HandPose, Quat, Vec3
from rhot.messages.objects import Contact, Grasp, ObjectContacts, ObjectPose
from rhot.object_motion import ObjectHistory
from services.object_tracker.contacts.distances import (
    PartDistance,
    SeenHand,
    is_near,
    part_distances,
    seen_hand,
)
from services.object_tracker.contacts.grasp import GraspTracker
from services.object_tracker.contacts.touch import TouchTracker

# States whose pose is where the object is; out_of_range still is, if less exactly.
_LOCATED = ("ok", "out_of_range")
# A grasp that has ended is told of for a minute: so long a client may hear nothing, and miss none.
_FORGOTTEN_NS = 60_000_000_000
# A wire's digits: a micrometre, as of every position.
_DIGITS = 6


def solids_of(config: RigConfig) -> dict[str, Solid]:
    """The objects of rig.toml that have a shape.

    Raises ConfigError or CalibrationError if a shape or its file cannot be used.
    """
    found = {item.name: solid_of(item, Path(config.folder)) for item in config.object}
    return {name: solid for name, solid in found.items() if solid is not None}


class ContactStep:
    """All objects with a shape, and both hands; the same messages give the same contacts."""

    def __init__(self, solids: Mapping[str, Solid]) -> None:
        self._objects = {name: _Object(name, solid) for name, solid in solids.items()}

    def note(self, pose: ObjectPose) -> None:
        """The next pose of an object; those without a shape are left out."""
        item = self._objects.get(pose.object)
        if item is not None:
            item.history.add(pose)

    def step(self, hand: HandPose) -> list[ObjectContacts]:
        """What a hand's pose changes, object by object."""
        seen = seen_hand(hand)
        messages = [item.step(seen) for item in self._objects.values()]
        return [one for one in messages if one is not None]

    def idle(self, stamp_ns: int) -> list[ObjectContacts]:
        """Nothing came until stamp_ns: messages of the objects for which this ends something."""
        messages = [item.idle(stamp_ns) for item in self._objects.values()]
        return [one for one in messages if one is not None]


class _Hand:
    """One hand at one object."""

    def __init__(self) -> None:
        self.touches = {part: TouchTracker(opens=part != "palm") for part in PARTS}
        self.grasp = GraspTracker()
        self.distances: list[PartDistance] = []
        self.seen_ns = dict.fromkeys(PARTS, 0)

    @property
    def busy(self) -> bool:
        return self.grasp.holding or any(touch.touching for touch in self.touches.values())

    def step(self, seen: SeenHand, pose: ObjectPose, solid: Solid) -> None:
        hand = seen.pose
        self.distances = part_distances(seen, pose, solid)
        for one in self.distances:
            if not one.predicted:
                self.seen_ns[one.part] = hand.stamp_ns
                self.touches[one.part].step(
                    hand.stamp_ns, one.distance_m, one.sigma_m, self.grasp.carried
                )
        self.expire(hand.stamp_ns)
        if any(touch.sure for part, touch in self.touches.items() if part != "palm"):
            self.touches["palm"].bear_out()
        wrist = _transform(hand.wrist.position_m, hand.wrist.orientation_wxyz)
        at = _transform(pose.position_m, pose.orientation_wxyz)
        self.grasp.step(hand.stamp_ns, self.distances, self.touches, at, wrist)
        if self.grasp.carried:
            self.touches["palm"].bear_out()

    def gone(self, stamp_ns: int) -> bool:
        """Whether it has not been near for so long that it need not be told of."""
        return not self.busy and stamp_ns - max(self.seen_ns.values()) > _FORGOTTEN_NS

    def expire(self, stamp_ns: int) -> None:
        """End the touches, and the grasp, of which nothing was seen for too long."""
        for part, seen_ns in self.seen_ns.items():
            # What is held cannot leave the fingers that hold it unseen.
            held = self.grasp.holding and stamp_ns - max(self.seen_ns.values()) <= KEPT_NS
            if stamp_ns - seen_ns > KEPT_NS and not held:
                self.touches[part].end(seen_ns + KEPT_NS)
        last_ns = max(self.seen_ns.values())
        if stamp_ns - last_ns > KEPT_NS:
            self.grasp.end(last_ns + KEPT_NS)
            self.distances = []


class _Object:
    """One object: its surface, where it was, and both hands at it."""

    def __init__(self, name: str, solid: Solid) -> None:
        self.history = ObjectHistory()
        self._name, self._solid = name, solid
        self._hands: dict[HandName, _Hand] = {}
        self._seq = 0
        self._stamp_ns = 0

    def step(self, seen: SeenHand) -> ObjectContacts | None:
        name, stamp_ns = seen.pose.hand, seen.pose.stamp_ns
        if stamp_ns < self._stamp_ns - KEPT_NS:
            # Time was set back: what was before is not known any more.
            self._hands.clear()
        self._stamp_ns = stamp_ns
        pose = self.history.at(stamp_ns)
        if pose is not None and not (pose.registered and pose.tracking in _LOCATED):
            pose = None
        own = self._hands.get(name, _Hand())
        if pose is not None and (own.busy or is_near(seen, pose, self._solid)):
            self._hands[name] = own
            own.step(seen, pose, self._solid)
        else:
            own.distances = []
        told = bool(self._hands)
        for hand in self._hands.values():
            hand.expire(stamp_ns)
        self._hands = {one: hand for one, hand in self._hands.items() if not hand.gone(stamp_ns)}
        return self._message(stamp_ns) if told else None

    def idle(self, stamp_ns: int) -> ObjectContacts | None:
        before = [hand.busy for hand in self._hands.values()]
        for hand in self._hands.values():
            hand.expire(stamp_ns)
        if before == [hand.busy for hand in self._hands.values()]:
            return None
        return self._message(stamp_ns)

    def _message(self, stamp_ns: int) -> ObjectContacts:
        self._seq += 1
        return ObjectContacts(
            object=self._name,
            seq=self._seq - 1,
            stamp_ns=stamp_ns,
            contacts=[
                _contact(name, one, hand.touches[one.part])
                for name, hand in self._hands.items()
                for one in hand.distances
            ],
            grasps=[
                Grasp(hand=name, parts=list(hand.grasp.parts), since_ns=hand.grasp.since_ns)
                for name, hand in self._hands.items()
                if hand.grasp.holding
            ],
            ended=[
                Grasp(
                    hand=name,
                    parts=list(hand.grasp.parts),
                    since_ns=hand.grasp.began_ns,
                    until_ns=hand.grasp.until_ns,
                )
                for name, hand in self._hands.items()
                if hand.grasp.began_ns
            ],
        )


def _contact(hand: HandName, one: PartDistance, touch: TouchTracker) -> Contact:
    x, y, z = np.round(one.point_m, _DIGITS).tolist()
    return Contact(
        hand=hand,
        part=one.part,
        distance_m=round(one.distance_m, _DIGITS),
        sigma_m=round(one.sigma_m, _DIGITS),
        point_m=(x, y, z),
        touching=touch.sure,
        since_ns=touch.since_ns if touch.sure else 0,
        until_ns=touch.until_ns,
    )


def _transform(position_m: Vec3, orientation_wxyz: Quat) -> Array:
    return transform(rotation_from_quaternion(orientation_wxyz), position_m)
