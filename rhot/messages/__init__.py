"""Every message that crosses the wire, and nothing else.

JSON, readable with any Zenoh command-line tool. Fields may be added, never renamed; unknown ones
are ignored, missing or wrong ones make the decoder raise, which the bus counts as `rejected`. Units
are part of the names. `stamp_ns` is CLOCK_REALTIME at the instant the content describes, `sent_ns`
the instant the sender handed the message to Zenoh, on the sender's own clock (0 in files).
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
import numpy as np

from rhot.errors import RefusalCode
from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, JOINT_INDEX, JOINTS, HandName

Vec3 = tuple[float, float, float]
Quat = tuple[float, float, float, float]
# A name that is one chunk of a Zenoh key.
Name = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")]
# int64 nanoseconds reach to the year 2262; anything else is not a stamp.
Stamp = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
Offset = Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Unit = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]


# A computer's name as others may print it, "" if it has none; a Zenoh session's id, "" if unknown.
Host = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{0,64}$")]
SessionId = Annotated[str, msgspec.Meta(pattern=r"^[0-9a-f]{0,32}$")]


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """Base of all messages."""


class Marker(Message, frozen=True, kw_only=True):
    """One coloured blob in one image.

    sigma_px is one standard deviation of each coordinate, quality 0..1. Of a marker that the
    picture's edge cuts, place and area are those of the whole: its middle may be outside, at most
    by its radius.
    """

    color: Name
    x_px: float
    y_px: float
    area_px: NonNegative
    sigma_px: NonNegative
    quality: Unit


class MarkerFrame(Message, frozen=True, kw_only=True):
    """All markers of one image, also when there are none.

    stamp_ns is mid-exposure of row 0 on the camera's own clock; a marker's own instant is stamp_ns
    + y_px * row_time_ns, and subtracting clock_offset_ns brings it to the master's clock.
    clock_sigma_ns is -1 while the offset is unknown.
    """

    camera: Name
    seq: Count
    stamp_ns: Stamp
    row_time_ns: Annotated[float, msgspec.Meta(ge=0.0, le=1e8)]
    clock_offset_ns: Offset
    clock_sigma_ns: Annotated[int, msgspec.Meta(ge=-1, le=2**62)]
    size_px: tuple[
        Annotated[int, msgspec.Meta(ge=1, le=65536)], Annotated[int, msgspec.Meta(ge=1, le=65536)]
    ]
    markers: Annotated[list[Marker], msgspec.Meta(max_length=256)]
    sent_ns: Stamp = 0


PointSource = Literal["measured", "predicted"]


class HandPoint(Message, frozen=True, kw_only=True, omit_defaults=True):
    """A landmark in the rig frame; sigma_m is one standard deviation along each rig axis.

    covariance_m2 is the upper triangle xx, xy, xz, yy, yz, zz of its error's covariance: a landmark
    that one camera sees is known well across that camera's ray and badly along it, whichever way
    the rig's axes lie. None if the sender knows no more than sigma_m.
    """

    name: Name
    position_m: Vec3
    sigma_m: tuple[NonNegative, NonNegative, NonNegative]
    cameras: list[Name]
    source: PointSource
    covariance_m2: tuple[float, float, float, float, float, float] | None = None


class HandPoints(Message, frozen=True, kw_only=True):
    """The marked landmarks of one hand at one instant of the master's clock."""

    hand: HandName
    seq: Count
    stamp_ns: Stamp
    points: Annotated[list[HandPoint], msgspec.Meta(max_length=64)]
    sent_ns: Stamp = 0

    def point(self, name: str) -> HandPoint | None:
        """A landmark by its name, None if it is not known now."""
        return next((point for point in self.points if point.name == name), None)


JointSource = Literal["measured", "solved", "predicted"]


class WristPose(Message, frozen=True, kw_only=True):
    """Pose of the wrist joint in the rig frame."""

    position_m: Vec3
    orientation_wxyz: Quat


class HandJoint(Message, frozen=True, kw_only=True):
    """One of the 26 OpenXR joints in the rig frame."""

    name: str
    position_m: Vec3
    orientation_wxyz: Quat
    radius_m: NonNegative
    source: JointSource


class FingerAngles(Message, frozen=True, kw_only=True, omit_defaults=True):
    """Joint angles of one digit in radians; flexion is positive towards the palm, abduction towards
    the thumb side.

    Fingers: abduction and mcp at the MCP joint, pip, dip. Thumb: abduction and cmc at the CMC
    joint, mcp at the MCP joint, dip at the interphalangeal joint; pip is 0, as the thumb has no
    middle phalanx.
    """

    abduction: float
    mcp: float
    pip: float
    dip: float
    cmc: float = 0.0


FingerStatus = Literal["solved", "unreachable", "not_converged", "predicted"]


class FingerPose(Message, frozen=True, kw_only=True):
    """One digit's solution: residual_m is the distance left between the model's marker and the
    measured one.

    sigma_rad is one standard deviation of its angles (root mean square over those that can move),
    None if the sender knows none.
    """

    name: Literal["thumb", "index", "middle", "ring", "little"]
    angles_rad: FingerAngles
    residual_m: NonNegative
    iterations: Count
    status: FingerStatus
    sigma_rad: NonNegative | None = None

    @property
    def model_angles_rad(self) -> tuple[float, float, float, float]:
        """In the order of a HandModel's limits_rad: abduction, cmc, mcp, dip of the thumb.

        Abduction, mcp, pip, dip of a finger.
        """
        a = self.angles_rad
        return (
            (a.abduction, a.cmc, a.mcp, a.dip)
            if self.name == "thumb"
            else (a.abduction, a.mcp, a.pip, a.dip)
        )


class HandPose(Message, frozen=True, kw_only=True):
    """The full hand at one instant of the master's clock; joints in OpenXR order, fingers from
    thumb to little.

    wrist_sigma_m and wrist_sigma_rad are one standard deviation of how far the wrist's position and
    orientation may be off, as lengths of vectors, from the covariance of the solution; None if the
    sender knows none.

    model_misfit: how far landmarks lately missed the fitted model, squared, over what they usually
    do with a hand of the tables: .1 to .9 where it fits, 1 to 5 for hands of another build. None of
    a hand that was measured, or if the sender does not know.
    """

    hand: HandName
    seq: Count
    stamp_ns: Stamp
    method: str
    wrist: WristPose
    joints: Annotated[list[HandJoint], msgspec.Meta(min_length=26, max_length=26)]
    fingers: Annotated[list[FingerPose], msgspec.Meta(min_length=5, max_length=5)]
    wrist_sigma_m: NonNegative | None = None
    wrist_sigma_rad: NonNegative | None = None
    model_misfit: NonNegative | None = None
    sent_ns: Stamp = 0

    def joint(self, name: str) -> HandJoint:
        """One of the 26 joints by its OpenXR name; raises ValueError with the valid ones."""
        if name not in JOINT_INDEX:
            raise ValueError(f"there is no joint {name!r}; there are {', '.join(JOINTS)}")
        return self.joints[JOINT_INDEX[name]]

    def finger(self, name: str) -> FingerPose:
        """One digit by its name; raises ValueError with the valid ones."""
        if name not in DIGITS:
            raise ValueError(f"there is no finger {name!r}; there are {', '.join(DIGITS)}")
        return self.fingers[DIGITS.index(name)]

    @property
    def positions_m(self) -> Array:
        """All joints in the order of rhot.hand.JOINTS, (26, 3), rig frame."""
        return np.array([joint.position_m for joint in self.joints])

    @property
    def orientations_wxyz(self) -> Array:
        """All joints' orientations in the same order, (26, 4), rig frame."""
        return np.array([joint.orientation_wxyz for joint in self.joints])

    @property
    def angles_rad(self) -> Array:
        """All digits' angles, (5, 4), thumb to little: FingerPose.model_angles_rad."""
        return np.array([finger.model_angles_rad for finger in self.fingers])


class Session(Message, frozen=True, kw_only=True):
    """The start broadcast: trackers work while running; start_ns is on the master's clock."""

    running: bool
    start_ns: Stamp
    sent_ns: Stamp = 0


class Caption(Message, frozen=True, kw_only=True):
    """What is happening, in words for who looks at the page; step of steps, both 0 outside a tour.

    Sent once a second for as long as it holds.
    """

    title: Annotated[str, msgspec.Meta(max_length=100)]
    text: Annotated[str, msgspec.Meta(max_length=600)]
    step: Annotated[int, msgspec.Meta(ge=0, le=99)] = 0
    steps: Annotated[int, msgspec.Meta(ge=0, le=99)] = 0
    sent_ns: Stamp = 0


class ClockEcho(Message, frozen=True, kw_only=True):
    """Answer to a clock query: the master's clock when it answered, and which master it is.

    A rig has one master. Where several answer, session (of Zenoh) and host tell them apart, and
    uptime_ns which of them was first.
    """

    master_ns: Stamp
    session: SessionId = ""
    host: Host = ""
    uptime_ns: Count = 0


class Refusal(Message, frozen=True, kw_only=True):
    """Why a request was refused: the payload of a query's error reply. What was before stays."""

    code: RefusalCode
    reason: str
