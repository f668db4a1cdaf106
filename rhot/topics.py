"""THE table of topics: key, message, expected rate, quality of service, recorded or not.

No key string is written anywhere else: publishers, subscribers, health, recorder, `rhot top` and
docs/reference/topics.md derive from TOPICS. A key is `<root>/<rig>/` + the template with its fields
filled in, root being `rhot` for all but pictures; a field left out becomes the wildcard `*`.
"""

from __future__ import annotations

from typing import TypeVar

import rhot.messages as m
import rhot.messages.calibration as g
import rhot.messages.camera as c
import rhot.messages.health as h
import rhot.messages.objects as o
import rhot.messages.recording as r
import rhot.messages.simulator as s
from rhot.topic_kinds import ROOT as ROOT
from rhot.topic_kinds import Kind as Kind
from rhot.topic_kinds import Priority as Priority
from rhot.topic_kinds import Rate as Rate
from rhot.topic_kinds import Topic as Topic

T = TypeVar("T")


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
    about="JPEG, published while somebody subscribes; SeenInPicture in the attachment",
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
CALIBRATE = _query(
    "control/calibrate", g.CalibrationState, Priority.DATA, "guided calibration; a payload orders"
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
_RECORDER = "what the recorder does; a query with a RecorderRequest changes it"
RECORDER = _query("control/recorder", r.RecorderState, Priority.DATA, _RECORDER)
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
    CALIBRATE,
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
