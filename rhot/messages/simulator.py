"""What only the simulator sends: ground truth, and what goes with a virtual camera's picture."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from rhot.messages import (
    Count,
    FingerAngles,
    Message,
    Name,
    NonNegative,
    Offset,
    Quat,
    Stamp,
    Vec3,
    WristPose,
)


class HandTruth(Message, frozen=True, kw_only=True):
    """What the simulator knows of one hand.

    points_m maps a landmark to its OpenXR joint's position in the rig frame.
    """

    points_m: dict[str, Vec3]
    wrist: WristPose
    angles_rad: dict[str, FingerAngles]


# A part of one hand: `right.thumb`, ..., `left.palm` (HandPart of rhot/messages/objects.py).
PartOfHand = Annotated[
    str, msgspec.Meta(pattern=r"^(left|right)\.(thumb|index|middle|ring|little|palm)$")
]


class ObjectTruth(Message, frozen=True, kw_only=True):
    """What the simulator knows of one object, in the rig frame.

    contacts is how far the skin of each hand's part is from the object's surface, in metres,
    negative where they overlap; empty where the object has no shape. held_by is the hand whose
    fingers press it against the thumb or the palm, empty if none does.
    """

    position_m: Vec3
    orientation_wxyz: Quat
    contacts: dict[PartOfHand, float] = msgspec.field(default_factory=dict)
    held_by: Literal["", "left", "right"] = ""


class Truth(Message, frozen=True, kw_only=True):
    """One line of truth.jsonl, and the simulator's live topic."""

    stamp_ns: Stamp
    hands: dict[str, HandTruth]
    objects: dict[str, ObjectTruth]
    sent_ns: Stamp = 0


class SimFrame(Message, frozen=True, kw_only=True):
    """The attachment of a simulated camera's image (I420 bytes): what a driver tells, and how far
    its computer's clock is ahead now.

    full_range: Y in 0..255 instead of 16..235.
    """

    camera: Name
    seq: Count
    stamp_ns: Stamp
    row_time_ns: NonNegative
    size_px: tuple[int, int]
    clock_skew_ns: Offset
    full_range: bool = False


# Whoever tries what a wrong clock does needs seconds, a missing time zone hours; more is a mistake.
_DAY_NS = 86_400 * 10**9


class SimClock(Message, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far somebody set the clock of a simulated camera computer ahead; negative: back.

    As a request: how far it shall be.
    """

    ahead_ns: Annotated[int, msgspec.Meta(ge=-_DAY_NS, le=_DAY_NS)]


# Farther than half a turn is the same as less the other way round.
_Degrees = Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]


class SimBoard(Message, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A calibration board as `rhot board` prints it, carried before simulated cameras.

    It is carried to the place of that number and held still there; each number has its own place.
    camera is the one whose picture it is carried through, "" for what all cameras see.
    """

    kind: Literal["chessboard", "charuco"] = "chessboard"
    camera: Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{0,64}$")] = ""
    place: Annotated[int, msgspec.Meta(ge=0, le=100_000)] = 0


# Slower, a calibration's patience ends; faster, motion blurs the paint.
_Speed = Annotated[float, msgspec.Meta(ge=0.1, le=4.0)]


class SimStage(Message, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the simulator shows, and what has gone wrong with it: to be tried without any hardware.

    scene is one of the catalogue's, "" the one of rig.toml. hidden are landmarks whose paint is
    covered, as `right.index_tip`. turned_deg says how far cameras were turned about their own x
    (down), y (right) and z after the calibration, which knows nothing of it. board is shown instead
    of hands and objects. speed makes what moves faster; begins_in_s lets the hands wait so long and
    then do the scene from its beginning, None: they are in the midst of it.

    As a request: what shall be. With lease_s for so long, unless who asked asks again; then what
    was there before is shown again, as it is at once with a lease of 0. A request that only
    renews changes nothing where something else is shown by then.
    """

    scene: Annotated[str, msgspec.Meta(max_length=64)] = ""
    hidden: Annotated[list[str], msgspec.Meta(max_length=64)] = msgspec.field(default_factory=list)
    turned_deg: dict[Name, tuple[_Degrees, _Degrees, _Degrees]] = msgspec.field(
        default_factory=dict
    )
    board: SimBoard | None = None
    speed: _Speed = 1.0
    begins_in_s: Annotated[float, msgspec.Meta(ge=0.0, le=60.0)] | None = None
    lease_s: Annotated[float, msgspec.Meta(ge=0.0, le=60.0)] | None = None
    renews: bool = False

    def shows_as(self, other: SimStage) -> bool:
        """Whether both show the same, wherever a board is: it may be on its way."""
        return _apart_from_place(self) == _apart_from_place(other)


def _apart_from_place(stage: SimStage) -> SimStage:
    board = stage.board and msgspec.structs.replace(stage.board, place=0)
    return msgspec.structs.replace(stage, board=board, lease_s=None, renews=False)
