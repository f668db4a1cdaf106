"""What the bridge says over WebSocket, and what it understands. Pure.

Every frame is text, one JSON object {"topic": ..., "message": ...}. The first is `hello`; then come
the rig's messages as the bus has them (docs/reference/messages.md), under their keys without root
and rig: hand/right/pose, object/cup/pose, object/cup/contacts. A client may send {"subscribe":
[...], "rate_hz": ...}, answered by `subscribed`; what does not fit closes its connection.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Annotated

import msgspec

from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINTS
from rhot.topics import CONTACTS, OBJECT, POSE

# Changed when a program that was written for it no longer understands it.
PROTOCOL = 1
# A request is a few names; a longer one is not read.
MAX_REQUEST_BYTES = 4096

Pattern = Annotated[
    str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.*-]{1,64}(/[A-Za-z0-9_.*-]{1,64}){0,3}$")
]


class ObjectShape(msgspec.Struct, frozen=True, omit_defaults=True):
    """An object as rig.toml describes it; mesh is the address of a GLB, where the server has one.

    size_m: box along x, y, z; cylinder diameter and height along y; sphere diameter.
    """

    name: str
    shape: str = ""
    size_m: tuple[float, ...] = ()
    mesh: str = ""


class Hello(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=False):
    """The first message of every connection."""

    version: str
    rig: str
    hands: list[str]
    objects: list[ObjectShape]
    rate_hz: float
    program: str = "rhot"
    protocol: int = PROTOCOL
    # T_floor_from_rig row by row, for who draws: the floor's y points up.
    floor_from_rig: tuple[float, ...] = ()
    frames: dict[str, str] = msgspec.field(
        default_factory=lambda: {
            "rig": "right-handed, metres; of the first camera (x right, y down, z forward) unless "
            "[rig.world] turns it",
            "joints": "OpenXR: -z along the bone, y out of the back of the hand, x right",
            "orientation_wxyz": "unit quaternion, w first",
            "stamp_ns": "nanoseconds since 1970, the rig's clock",
        }
    )
    joints: tuple[str, ...] = JOINTS
    angles: dict[str, tuple[str, ...]] = msgspec.field(
        default_factory=lambda: dict(zip(DIGITS, DIGIT_ANGLES, strict=True))
    )
    topics: tuple[str, ...] = tuple(topic.template for topic in (POSE, OBJECT, CONTACTS))


class Request(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a client asks for: topics, `*` for any one part; frames a second at most."""

    subscribe: Annotated[list[Pattern], msgspec.Meta(max_length=32)]
    rate_hz: Annotated[float, msgspec.Meta(gt=0.0, le=240.0)] | None = None

    def wants(self, topic: str) -> bool:
        """Whether a topic is among those asked for."""
        parts = topic.split("/")
        return any(_fits(pattern.split("/"), parts) for pattern in self.subscribe)


# Without a request a client gets everything.
EVERYTHING = Request(subscribe=["*/*/*"])


def request_from(text: str | bytes) -> Request:
    """What a client sent. Raises ValueError saying what would be right."""
    try:
        return msgspec.json.decode(text, type=Request)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f'send {{"subscribe":["hand/*/pose"],"rate_hz":30}}: {error}') from None


def frame(topic: str, message: msgspec.Struct) -> str:
    """One frame."""
    content = msgspec.json.encode(message).decode()
    return f'{{"topic":"{topic}","message":{content}}}'


def hello(
    config: RigConfig,
    version: str,
    rate_hz: float,
    *,
    meshes: Mapping[str, str] = MappingProxyType({}),
    floor_from_rig: Sequence[float] = (),
) -> Hello:
    """What this rig's bridge says of itself; meshes are addresses by the objects' names."""
    return Hello(
        version=version,
        rig=config.rig.name,
        hands=list(config.hand),
        objects=[_shape(table, meshes.get(table.name, "")) for table in config.object],
        rate_hz=rate_hz,
        floor_from_rig=tuple(floor_from_rig),
    )


def _shape(table: ObjectTable, mesh: str) -> ObjectShape:
    return ObjectShape(name=table.name, shape=table.shape, size_m=table.size_m, mesh=mesh)


def _fits(pattern: list[str], parts: list[str]) -> bool:
    return len(pattern) == len(parts) and all(
        want in ("*", part) for want, part in zip(pattern, parts, strict=True)
    )
