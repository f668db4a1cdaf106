"""Which keys belong to the rig that is recorded, and how many others are let in.

Names in keys come from the network: a stranger who publishes under ever new ones must neither fill
the memory nor take the place of the rig's own. Pure.
"""

from __future__ import annotations

from collections.abc import Mapping

from rhot.files.config import RigConfig
from rhot.topics import Topic

# Room for a guest's services and a tracker that is being added to rig.toml.
MAX_STRANGERS = 64
_SERVICES = {
    "pi_tracker",
    "fusion",
    "solver",
    "object_tracker",
    "simulator",
    "viewer",
    "recorder",
}


class RigKeys:
    """Decides which keys are recorded: all of the rig's, and the first strangers'."""

    def __init__(self, config: RigConfig) -> None:
        cameras = {camera.name for camera in config.camera}
        self._names: Mapping[str, set[str]] = {
            "camera": cameras,
            "hand": {"left", "right"},
            "object": {item.name for item in config.object},
            "serial": {item.serial for item in config.object},
            "service": _SERVICES,
            "instance": {"main", *cameras},
        }
        self._strangers: set[str] = set()

    def admits(self, topic: Topic, key: str) -> bool:
        """Whether messages of a key are kept."""
        names = topic.names(key) or {}
        if all(value in self._names.get(field, ()) for field, value in names.items()):
            return True
        if len(self._strangers) < MAX_STRANGERS:
            self._strangers.add(key)
        return key in self._strangers
