"""What a topic is: how it travels, how often, how urgently, and its key.

The table of all topics is rhot/topics.py, which hands these on.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

from rhot.errors import BusError

T = TypeVar("T")

ROOT = "rhot"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")
_FIELD = re.compile(r"\{(\w+)\}")


class Kind(Enum):
    """How a topic travels."""

    STREAM = "stream"  # published, and dropped rather than late
    QUERY = "query"  # asked for
    STATE = "state"  # published on change, and asked for by late comers
    TOKEN = "token"  # liveliness


class Rate(Enum):
    """Where a stream's expected rate comes from; rig.toml turns it into Hz (RigConfig.rate_hz)."""

    CAMERA = "frame rate of that camera"
    HAND = "fusion output rate"
    OBJECT = "rate of the pose source"
    BEAT = "1 Hz"
    DEMAND = "on demand"


class Priority(Enum):
    """Zenoh priority of a topic: poses before health, health before pictures."""

    REAL_TIME = "real time"
    DATA = "data"
    BACKGROUND = "background"


@dataclass(frozen=True)
class Topic(Generic[T]):
    """One row of the table.

    message is None where the payload is not JSON (media_type says what it is).
    """

    template: str
    message: type[T] | None
    kind: Kind
    rate: Rate
    priority: Priority
    recorded: bool
    about: str
    media_type: str = "application/json"
    # Larger payloads are rejected unread: every message is untrusted. 64 KiB is six times the
    # largest (HandPose, 9 kB).
    max_bytes: int = 65_536
    # Whether each real-time message leaves at once, or those of one instant together: 16 objects at
    # 250 Hz cost .43 instead of .50 of a core so, and one object's messages are .1 ms later.
    express: bool = True
    # First part of the key. Pictures have another, so that a subscription to rhot/** shows JSON and
    # stays small.
    root: str = ROOT

    @property
    def name(self) -> str:
        """The template without its fields, to speak of the topic: `camera/markers`."""
        return re.sub(r"\{\w+\}/?", "", self.template).rstrip("/")

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields in the template."""
        return tuple(_FIELD.findall(self.template))

    @property
    def encoding(self) -> str:
        """Zenoh encoding of the payload."""
        return (
            self.media_type
            if self.message is None
            else f"{self.media_type};rhot.{self.message.__name__}.1"
        )

    def key(self, rig: str, **names: str) -> str:
        """The key of one stream, or a key expression where fields are left out."""
        unknown = set(names) - set(self.fields)
        if unknown:
            raise BusError(
                f"topic {self.template} has no field {sorted(unknown)}; it has {list(self.fields)}"
            )
        for field, value in {"rig": rig, **names}.items():
            if not _NAME.match(value) and not (field == "rig" and value == "*"):
                raise BusError(
                    f"{field} name {value!r} cannot be part of a key; "
                    "use letters, digits, '_', '-' and '.', starting with a letter or digit"
                )
        return f"{self.root}/{rig}/" + _FIELD.sub(
            lambda match: names.get(match[1], "*"), self.template
        )

    def names(self, key: str) -> dict[str, str] | None:
        """The fields of a key of this topic, or None if the key is another's."""
        pattern = _FIELD.sub(r"(?P<\1>[^/]+)", self.template)
        match = re.fullmatch(rf"{self.root}/[^/]+/{pattern}", key)
        return match.groupdict() if match else None
