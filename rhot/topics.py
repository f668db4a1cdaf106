"""THE table of topics: key, message, expected rate, quality of service, recorded or not.

No key string is written anywhere else: publishers, subscribers, health, recorder, `rhot top` and
docs/reference/topics.md derive from TOPICS. A key is `<root>/<rig>/` + the template with its fields
filled in, root being `rhot` for all but pictures; a field left out becomes the wildcard `*`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

import rhot.messages as m
import rhot.messages.camera as c
import rhot.messages.health as h
import rhot.messages.objects as o
import rhot.messages.recording as r
import rhot.messages.simulator as s
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


def _stream(template: str, message: type[T], rate: Rate, about: str) -> Topic[T]:
    return Topic(template, message, Kind.STREAM, rate, Priority.REAL_TIME, True, about)


def _query(template: str, message: type[T], priority: Priority, about: str) -> Topic[T]:
    return Topic(template, message, Kind.QUERY, Rate.DEMAND, priority, False, about)


def _setting(template: str, message: type[T], about: str) -> Topic[T]:
    return Topic(template, message, Kind.STATE, Rate.DEMAND, Priority.DATA, False, about)


# What every camera, hand and object sends, frame by frame.
MARKERS = _stream(
    "camera/{camera}/markers", m.MarkerFrame, Rate.CAMERA, "coloured blobs of every image"
)
POINTS = _stream("hand/{hand}/points", m.HandPoints, Rate.HAND, "3D landmarks")
POSE = _stream("hand/{hand}/pose", m.HandPose, Rate.HAND, "the full hand")
OPENVR = _stream(
    "openvr/{serial}/pose", o.OpenVrPose, Rate.OBJECT, "tracked devices as SteamVR reports them"
)
OBJECT = Topic(
    "object/{object}/pose",
    o.ObjectPose,
    Kind.STREAM,
    Rate.OBJECT,
    Priority.REAL_TIME,
    recorded=True,
    about="objects in the rig frame",
    express=False,
)
OPENVR_EVENT = Topic(
    "openvr/{host}/event",
    o.OpenVrEvent,
    Kind.STREAM,
    Rate.DEMAND,
    Priority.DATA,
    recorded=True,
    about="what SteamVR says of devices and of its origin",
)
CONTACTS = _stream(
    "object/{object}/contacts",
    o.ObjectContacts,
    # At the hands' rate while one is near an object that has a shape; nothing is amiss without.
    Rate.DEMAND,
    "who touches an object, and who holds it",
)
TRUTH = _stream("sim/truth", s.Truth, Rate.CAMERA, "the simulator's ground truth")
SIM_CLOCK = _query(
    "sim/{camera}/clock",
    s.SimClock,
    Priority.DATA,
    "a simulated camera computer's clock; a query with a payload sets it",
)
SIM_STAGE = _query(
    "sim/stage", s.SimStage, Priority.DATA, "what the simulator shows; a payload sets it"
)

# Pictures: only for who asks.
PREVIEW: Topic[bytes] = Topic(
    "camera/{camera}/preview",
    None,
    Kind.STREAM,
    Rate.DEMAND,
    Priority.BACKGROUND,
    recorded=False,
    about="JPEG, published while somebody subscribes",
    media_type="image/jpeg",
    max_bytes=4_000_000,
    # A subscription to rhot/** must not make cameras encode pictures.
    root="rhot-picture",
)
FRAME: Topic[bytes] = Topic(
    "camera/{camera}/frame",
    None,
    Kind.QUERY,
    Rate.DEMAND,
    Priority.BACKGROUND,
    recorded=False,
    about="one lossless frame for calibration",
    media_type="image/png",
    max_bytes=40_000_000,
)
SIM_FRAME: Topic[bytes] = Topic(
    "camera/{camera}/image",
    None,
    Kind.STREAM,
    Rate.CAMERA,
    Priority.DATA,
    recorded=False,
    about="I420 images of a simulated camera; SimFrame in the attachment",
    media_type="application/octet-stream",
    max_bytes=40_000_000,
    root="rhot-sim",
)

# What is set on a camera. A query with a payload changes it and is answered with what holds then,
# or with a Refusal; a put changes it, too, but hears of a refusal in health only.
COLORS = _setting(
    "camera/{camera}/colors", c.Colors, "colour ranges; a query with a payload, or a put, sets them"
)
EXPOSURE = _setting(
    "camera/{camera}/exposure",
    c.ExposureControl,
    "exposure; a query with a payload, or a put, sets it or runs the automatics once",
)
FIT = _query(
    "camera/{camera}/fit",
    c.FitResult,
    Priority.BACKGROUND,
    "ranges fitted to the patches of a FitRequest",
)

# The rig as a whole.
SESSION = Topic(
    "control/session",
    m.Session,
    Kind.STATE,
    Rate.DEMAND,
    Priority.REAL_TIME,
    recorded=True,
    about="the start broadcast",
)
RECORDER = _query(
    "control/recorder",
    r.RecorderState,
    Priority.DATA,
    "what the recorder does; a query with a RecorderRequest changes it",
)
RECORDINGS = _query("control/recordings", r.Recordings, Priority.DATA, "the recorder's files")
CAPTION = _stream(
    "control/caption", m.Caption, Rate.DEMAND, "what is happening, in words: a tour's captions"
)
CLOCK = _query("control/clock", m.ClockEcho, Priority.REAL_TIME, "the master's clock")
HEALTH = Topic(
    "service/{service}/{instance}/health",
    h.Health,
    Kind.STREAM,
    Rate.BEAT,
    Priority.DATA,
    recorded=True,
    about="state of each service",
)
ALIVE: Topic[bytes] = Topic(
    "service/{service}/{instance}/alive",
    None,
    Kind.TOKEN,
    Rate.DEMAND,
    Priority.DATA,
    recorded=False,
    about="liveliness token",
    media_type="",
    max_bytes=0,
)

TOPICS: tuple[Topic, ...] = (
    MARKERS,
    POINTS,
    POSE,
    OPENVR,
    OPENVR_EVENT,
    OBJECT,
    CONTACTS,
    TRUTH,
    SIM_CLOCK,
    SIM_STAGE,
    PREVIEW,
    FRAME,
    SIM_FRAME,
    COLORS,
    EXPOSURE,
    FIT,
    SESSION,
    RECORDER,
    RECORDINGS,
    CAPTION,
    CLOCK,
    HEALTH,
    ALIVE,
)


def find(key: str) -> Topic | None:
    """The topic a full key belongs to, or None."""
    return next((topic for topic in TOPICS if topic.names(key) is not None), None)
