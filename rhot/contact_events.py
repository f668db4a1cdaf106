"""Touches and grasps as events: what changed from one ObjectContacts to the next. Pure.

Each message holds the whole state, with the instants at which it became so: lost messages lose no
grasp, and of touches only those that began and ended between two messages that arrived. Events
carry the instant when it happened; they come some frames later. A state that is there in the first
message is an event too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeVar

from rhot.hand import HandName
from rhot.messages.objects import Contact, Grasp, HandPart, ObjectContacts

State = TypeVar("State")

# How long touches and grasps outlive the sight of a hand or an object: a blink of the lighthouse, a
# hand that hides its own paint. Fingers open and are gone in half a second.
KEPT_NS = 500_000_000
# Names come from the network; a rig has a few objects, and 16 trackers at most.
_MAX_OBJECTS = 64


@dataclass(frozen=True)
class TouchEvent:
    """A part of a hand began or ended to touch an object; stamp_ns is on the master's clock."""

    kind: Literal["begin", "end"]
    object: str
    hand: HandName
    part: HandPart
    stamp_ns: int


@dataclass(frozen=True)
class GraspEvent:
    """A hand began or ended to hold an object, with these parts."""

    kind: Literal["begin", "end"]
    object: str
    hand: HandName
    parts: tuple[HandPart, ...]
    stamp_ns: int


class _Touch(NamedTuple):
    since_ns: int
    listed_ns: int


class TouchEvents:
    """The touch events of a stream of messages, of one object or of many."""

    def __init__(self) -> None:
        self._objects: dict[str, dict[tuple[HandName, HandPart], _Touch]] = {}

    def feed(self, message: ObjectContacts) -> list[TouchEvent]:
        """What the next message says, in the order in which it happened."""
        touching = _of(self._objects, message.object, {})
        events = []
        for contact in message.contacts:
            events += self._contact(message, contact, touching)
        for (hand, part), known in list(touching.items()):
            # What is not listed is not seen now; it may come back, but not for ever.
            if message.stamp_ns - known.listed_ns >= KEPT_NS:
                del touching[hand, part]
                events.append(TouchEvent("end", message.object, hand, part, message.stamp_ns))
        return sorted(events, key=lambda event: event.stamp_ns)

    def _contact(
        self,
        message: ObjectContacts,
        contact: Contact,
        touching: dict[tuple[HandName, HandPart], _Touch],
    ) -> list[TouchEvent]:
        key = (contact.hand, contact.part)
        names = (message.object, contact.hand, contact.part)
        known = touching.pop(key, None)
        since_ns = contact.since_ns if contact.touching else 0
        events = []
        if known is not None and known.since_ns != since_ns:
            told = contact.until_ns >= known.since_ns
            at_ns = contact.until_ns if told else message.stamp_ns
            events.append(TouchEvent("end", *names, at_ns))
        if contact.touching:
            if known is None or known.since_ns != since_ns:
                events.append(TouchEvent("begin", *names, since_ns))
            touching[key] = _Touch(since_ns, message.stamp_ns)
        return events


class GraspEvents:
    """The grasp events of a stream of messages, of one object or of many."""

    def __init__(self) -> None:
        self._objects: dict[str, _Grasps] = {}

    def feed(self, message: ObjectContacts) -> list[GraspEvent]:
        """What the next message says, in the order in which it happened."""
        grasps = _of(self._objects, message.object, _Grasps())
        return grasps.feed(message)


class _Grasps:
    """The grasps of one object, by hand."""

    def __init__(self) -> None:
        self._held: dict[HandName, Grasp] = {}
        self._ended_ns: dict[HandName, int] | None = None

    def feed(self, message: ObjectContacts) -> list[GraspEvent]:
        events = []
        ended_ns = self._ended_ns
        for one in message.ended:
            known = self._held.get(one.hand)
            if known is not None and known.since_ns == one.since_ns:
                del self._held[one.hand]
                events.append(_event("end", message, one, one.until_ns))
            elif ended_ns is not None and one.until_ns > ended_ns.get(one.hand, 0):
                # It began and ended in messages that were lost.
                events.append(_event("begin", message, one, one.since_ns))
                events.append(_event("end", message, one, one.until_ns))
        self._ended_ns = {one.hand: one.until_ns for one in message.ended}
        now = {one.hand: one for one in message.grasps}
        for hand, known in list(self._held.items()):
            # Ended without a word: the object tracker was started anew.
            if hand not in now or now[hand].since_ns != known.since_ns:
                del self._held[hand]
                events.append(_event("end", message, known, message.stamp_ns))
        for hand, one in now.items():
            if hand not in self._held:
                events.append(_event("begin", message, one, one.since_ns))
            self._held[hand] = one
        return sorted(events, key=lambda event: event.stamp_ns)


def _event(
    kind: Literal["begin", "end"], message: ObjectContacts, grasp: Grasp, stamp_ns: int
) -> GraspEvent:
    return GraspEvent(kind, message.object, grasp.hand, tuple(grasp.parts), stamp_ns)


def _of(objects: dict[str, State], name: str, fresh: State) -> State:
    if name not in objects and len(objects) >= _MAX_OBJECTS:
        objects.clear()
    return objects.setdefault(name, fresh)
