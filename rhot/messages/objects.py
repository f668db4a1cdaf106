"""Messages about objects: poses of tracked devices as SteamVR reports them, objects in the rig
frame, and who touches them.

As in rhot/messages/__init__.py: JSON, units in the names, fields added but never renamed.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from rhot.hand import HandName
from rhot.messages import Count, Message, Name, NonNegative, Offset, Quat, Stamp, Vec3


class OpenVrDevice(Message, frozen=True, kw_only=True, rename={"device_class": "class"}):
    """What SteamVR knows of a device beside its pose."""

    index: int
    serial: Name
    device_class: str
    model: str
    battery: float
    charging: bool


Row4 = tuple[float, float, float, float]


class OpenVrPose(Message, frozen=True, kw_only=True):
    """A TrackedDevicePose_t under Valve's own field names, with what it lacks: device, universe,
    stamp.

    mDeviceToAbsoluteTracking is 3x4 row by row, column 3 the translation in metres, in the
    `lighthouse` frame. universe names that frame: another name is another frame. stamp_ns is on the
    sender's clock; subtracting clock_offset_ns brings it to the master's. clock_sigma_ns is -1
    while the offset is unknown.
    """

    v: int
    seq: Count
    stamp_ns: Stamp
    universe: str
    device: OpenVrDevice
    mDeviceToAbsoluteTracking: tuple[Row4, Row4, Row4]  # noqa: N815 - Valve's name
    vVelocity: Vec3  # noqa: N815
    vAngularVelocity: Vec3  # noqa: N815
    eTrackingResult: int  # noqa: N815
    bPoseIsValid: bool  # noqa: N815
    bDeviceIsConnected: bool  # noqa: N815
    clock_offset_ns: Offset = 0
    clock_sigma_ns: Annotated[int, msgspec.Meta(ge=-1, le=2**62)] = -1
    sent_ns: Stamp = 0


class OpenVrEvent(Message, frozen=True, kw_only=True):
    """An event of SteamVR that concerns poses: a device came or went, the origin may have moved.

    event_type is Valve's number (VREvent_t.eventType), name its name without `VREvent_`, serial
    that of the device it is about, or empty.
    """

    v: int
    stamp_ns: Stamp
    event_type: Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]
    name: Annotated[str, msgspec.Meta(max_length=64)]
    serial: Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{0,64}$")] = ""
    universe: Annotated[str, msgspec.Meta(max_length=64)] = ""
    clock_offset_ns: Offset = 0
    sent_ns: Stamp = 0


ObjectTracking = Literal[
    "ok", "out_of_range", "rotation_only", "calibrating", "lost", "unregistered"
]


class ObjectPose(Message, frozen=True, kw_only=True):
    """A tracked object.

    In the rig frame if registered is true, else still in the lighthouse frame; a pose that would be
    "ok" is then "unregistered". sigma_m and sigma_rad are one standard deviation of where its
    origin is and how it is turned, as lengths of vectors, None if the sender knows none.
    """

    object: Name
    serial: Name
    seq: Count
    stamp_ns: Stamp
    position_m: Vec3
    orientation_wxyz: Quat
    velocity_m_s: Vec3
    angular_velocity_rad_s: Vec3
    tracking: ObjectTracking
    registered: bool
    sigma_m: NonNegative | None = None
    sigma_rad: NonNegative | None = None
    sent_ns: Stamp = 0


# What of a hand may touch an object.
HandPart = Literal["thumb", "index", "middle", "ring", "little", "palm"]


class Contact(Message, frozen=True, kw_only=True):
    """How far one finger tip, or the palm, is from an object's surface.

    distance_m is from skin to surface, negative where they overlap; sigma_m its standard deviation.
    point_m is the point of the surface that is nearest, in the rig frame. since_ns is when the
    touch began, 0 while nothing touches; until_ns when the last one ended, 0 if none did. Both are
    when it happened, some frames before the first message that says so.
    """

    hand: HandName
    part: HandPart
    distance_m: float
    sigma_m: NonNegative
    point_m: Vec3
    touching: bool
    since_ns: Stamp = 0
    until_ns: Stamp = 0


class Grasp(Message, frozen=True, kw_only=True):
    """A hand holds an object: which parts of it, and since when.

    until_ns is 0 while it does; of a grasp that has ended, parts are those that held last.
    """

    hand: HandName
    parts: Annotated[list[HandPart], msgspec.Meta(max_length=6)]
    since_ns: Stamp
    until_ns: Stamp = 0


class ObjectContacts(Message, frozen=True, kw_only=True):
    """Who touches an object at one instant of the master's clock, and who holds it.

    contacts has every part of every hand in view whose distance is known; grasps one entry a hand
    that holds it, ended the last one of each hand that is over. The state is whole in every
    message, so that a lost one loses no event.
    """

    object: Name
    seq: Count
    stamp_ns: Stamp
    contacts: Annotated[list[Contact], msgspec.Meta(max_length=16)]
    grasps: Annotated[list[Grasp], msgspec.Meta(max_length=2)]
    ended: Annotated[list[Grasp], msgspec.Meta(max_length=2)] = msgspec.field(default_factory=list)
    sent_ns: Stamp = 0
