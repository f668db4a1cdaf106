"""Objects of a rig as an onlooker sees them: state, age, who touches and who holds. Pure.

Of each object the newest pose and the newest contacts count. What is not heard for a second is
silent; contacts that old are no contacts. Nothing from the network makes it grow without bound.
"""

from __future__ import annotations

from rhot.files.config import RigConfig
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.watch.object_words import state_of
from rhot.watch.rig_state import ObjectRow

# Ten times what the slowest source (10 Hz) leaves between two poses.
_SILENT_NS = 1_000_000_000
# OpenVR knows 64 devices; no rig has half as many objects.
_MAX_OBJECTS = 32


class ObjectWatch:
    """What has been heard of the objects of rig.toml, and of others."""

    def __init__(self, config: RigConfig) -> None:
        self._expected = [table.name for table in config.object]
        # By object: when its newest message came, and the message.
        self._poses: dict[str, tuple[int, ObjectPose]] = {}
        self._contacts: dict[str, tuple[int, ObjectContacts]] = {}

    def pose(self, pose: ObjectPose, now_ns: int) -> None:
        """An object's pose arrived."""
        if pose.object in self._poses or self._has_room(pose.object):
            self._poses[pose.object] = (now_ns, pose)

    def contacts(self, contacts: ObjectContacts, now_ns: int) -> None:
        """Who touches an object arrived."""
        if contacts.object in self._contacts or self._has_room(contacts.object):
            self._contacts[contacts.object] = (now_ns, contacts)

    def rows(self, now_ns: int) -> list[ObjectRow]:
        """A row an object: those of rig.toml first, then the others by name."""
        return [self._row(name, now_ns) for name in self._names()]

    def _names(self) -> list[str]:
        return list(dict.fromkeys([*self._expected, *sorted({*self._poses, *self._contacts})]))

    def _has_room(self, name: str) -> bool:
        return name in self._expected or len(self._names()) < _MAX_OBJECTS

    def _row(self, name: str, now_ns: int) -> ObjectRow:
        touching: dict[str, list[str]] = {}
        held_by: dict[str, list[str]] = {}
        heard_ns, contacts = self._contacts.get(name, (0, None))
        if contacts is not None and now_ns - heard_ns <= _SILENT_NS:
            for one in contacts.contacts:
                if one.touching:
                    touching.setdefault(one.hand, []).append(one.part)
            held_by = {grasp.hand: list(grasp.parts) for grasp in contacts.grasps}
        heard_ns, pose = self._poses.get(name, (0, None))
        if pose is None:
            return ObjectRow(object=name, state="absent", touching=touching, held_by=held_by)
        silent = now_ns - heard_ns > _SILENT_NS
        return ObjectRow(
            object=name,
            state="silent" if silent else state_of(pose.tracking, pose.registered),
            registered=pose.registered,
            heard_ns=heard_ns,
            # As old as it was when it came: who looks rarely does not make it older.
            age_ms=(heard_ns - pose.stamp_ns) * 1e-6,
            sigma_m=pose.sigma_m,
            touching=touching,
            held_by=held_by,
        )
