"""The links from a tracker's pose to who touches its object. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from rhot.faults.objects import OBJECTS
from rhot.files.rig_tables import ObjectTable
from rhot.messages.health import Fault
from rhot.watch.object_words import ADVICE, WORDS
from services.cli.doctor.links import Link, broken, from_faults, holds
from services.cli.doctor.observations import ObjectSeen, Observations

# What the object tracker says of objects and devices, in faults of its own.
OBJECT_CODES = {kind.code for kind in OBJECTS}
# An object that is seen in half of its poses is used; in fewer, somebody looks for a reason.
_SEEN = 0.5
# As for hands: a stream of a few messages in several seconds is none.
_MIN_MESSAGES = 3


def object_links(seen: Observations, told: Sequence[Fault]) -> list[Link]:
    """Every object of rig.toml, who touches it, and what is said of other devices."""
    if seen.config is None or not seen.config.object:
        return []
    links, others = [], list(told)
    for table in seen.config.object:
        found = seen.objects.get(table.name, ObjectSeen())
        own = [fault for fault in told if fault.subject in (table.name, table.serial)]
        others = [fault for fault in others if fault not in own]
        links.append(from_faults(f"object {table.name}", own) or _object(table, found))
        if table.shape and seen.config.hand:
            links.append(_touch(table, found, seen))
    rest = from_faults("tracked devices", others)
    return [*links, *([rest] if rest else [])]


def _object(table: ObjectTable, found: ObjectSeen) -> Link:
    name = f"object {table.name}"
    if not found.poses:
        text = f"no pose of {table.serial} arrives"
        action = "switch the tracker on, and see the object tracker's journal"
        return broken(name, "source_lost", text, action)
    if found.ok >= _SEEN * found.poses:
        return holds(name, f"{found.poses} poses, {found.ok} of them ok")
    text = f"{found.ok} of {found.poses} poses are ok; at last: {WORDS[found.state]}"
    return Link(name=name, state="worse", text=text, action=ADVICE[found.state])


def _touch(table: ObjectTable, found: ObjectSeen, seen: Observations) -> Link:
    name = f"touch of {table.name}"
    if found.contacts:
        return holds(name, f"{found.contacts} messages, {found.touching or 'nothing touches it'}")
    hands = sum(hand.poses for hand in seen.hands.values())
    if hands < _MIN_MESSAGES or found.ok < _MIN_MESSAGES:
        return holds(name, "nothing to judge by")
    text = f"nobody says how far the hands are from {table.name}"
    action = "see the object tracker's journal; `rhot top` shows whether it runs"
    return Link(name=name, state="worse", text=text, action=action)
