"""What a page and the calibrator say to each other while somebody calibrates a rig."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from rhot.hand import HandName
from rhot.messages import Count, Message, Name, Unit

# What the calibrator measures with pictures, markers and points that come over the bus.
CalibrationStep = Literal["lens", "stereo", "hand", "objects"]
# How a hand is measured: by exercises that a person follows, or while it is simply used.
HandWay = Literal["exercises", "use"]
CalibrationAction = Literal["start", "stop", "save"]
CalibrationPhase = Literal["idle", "collecting", "computing", "done", "saved", "failed"]
Sentence = Annotated[str, msgspec.Meta(max_length=1000)]


class CalibrationOrder(Message, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Start one step, stop it, or save what it has found.

    camera is whose lens is calibrated; square_mm and count (positions to show) are of the board
    that lens and stereo use, hand is the one that is measured, and way how. What a step does not
    need is not looked at.
    """

    action: CalibrationAction
    step: CalibrationStep = "hand"
    camera: Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]{0,64}$")] = ""
    hand: HandName = "right"
    way: HandWay = "exercises"
    square_mm: Annotated[float, msgspec.Meta(ge=1.0, le=1000.0)] = 25.0
    count: Annotated[int, msgspec.Meta(ge=5, le=200)] = 15


class CalibrationFigure(Message, frozen=True, kw_only=True):
    """One thing that is known of a result: `error of pictures left out`, `0.12 px`."""

    name: Sentence
    value: Sentence


class CalibrationState(Message, frozen=True, kw_only=True):
    """What the calibrator does now.

    progress is of the collecting; to_do is what a person should do next, seen what has been seen so
    far. Of a result: whether it is good, its figures, what to do about it, and once it is saved the
    files. A hand in use has a result while it is still being collected. number counts the steps
    that were started.
    """

    phase: CalibrationPhase = "idle"
    number: Count = 0
    order: CalibrationOrder | None = None
    progress: Unit = 0.0
    to_do: Sentence = ""
    seen: Annotated[list[Sentence], msgspec.Meta(max_length=32)] = msgspec.field(
        default_factory=list
    )
    good: bool = False
    figures: Annotated[list[CalibrationFigure], msgspec.Meta(max_length=32)] = msgspec.field(
        default_factory=list
    )
    advice: Annotated[list[Sentence], msgspec.Meta(max_length=32)] = msgspec.field(
        default_factory=list
    )
    files: Annotated[list[Name], msgspec.Meta(max_length=64)] = msgspec.field(default_factory=list)
