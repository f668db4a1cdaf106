"""Messages in, a hand out: from the exercises if they are in there, else from free motion. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rhot.errors import CalibrationError
from rhot.hand import HandName, default_hand
from rhot.messages import HandPoints

if TYPE_CHECKING:
    from services.calibrator.output.hand_file import HandFile


@dataclass(frozen=True)
class Wanted:
    """What is measured, and what goes into the file about it."""

    hand: HandName
    source: str
    date: str
    lengths_m: Mapping[tuple[int, int], float] = field(default_factory=dict)
    start_s: float | None = None


def from_exercises(messages: Sequence[HandPoints], wanted: Wanted) -> HandFile:
    """The hand of a guided recording. Raises CalibrationError if it is none."""
    from services.calibrator.hand.fit import fit_hand
    from services.calibrator.hand.recording import sort_exercises
    from services.calibrator.output.hand_file import hand_file

    table = default_hand(wanted.hand)
    recording = sort_exercises(_some(messages, wanted), table, start_s=wanted.start_s)
    problem, found = fit_hand(recording, table, wanted.lengths_m)
    return hand_file(problem, found, table, date=wanted.date, inputs=wanted.source)


def from_motion(messages: Sequence[HandPoints], wanted: Wanted) -> HandFile:
    """The hand of any motion. Raises CalibrationError if that shows too little."""
    from services.calibrator.hand.free_motion.estimate import estimate_hand
    from services.calibrator.hand.free_motion.frames import seen_frames
    from services.calibrator.output.hand_file import free_hand_file

    table = default_hand(wanted.hand)
    seen = seen_frames(_some(messages, wanted), table)
    found = estimate_hand(seen, table, wanted.lengths_m)
    return free_hand_file(found, seen, table, date=wanted.date, inputs=wanted.source)


def from_either(messages: Sequence[HandPoints], wanted: Wanted) -> tuple[HandFile, str]:
    """From the exercises if they are in the recording, else from free motion; and a note on that.

    Raises CalibrationError that says why it is neither.
    """
    _some(messages, wanted)
    try:
        return from_exercises(messages, wanted), ""
    except CalibrationError as error:
        guided = str(error)
    try:
        made = from_motion(messages, wanted)
    except CalibrationError as error:
        raise CalibrationError(
            f"{wanted.source}: as exercises: {guided}; as free motion: {error}"
        ) from None
    return made, f"no exercises in it ({guided}); measured from free motion"


def _some(messages: Sequence[HandPoints], wanted: Wanted) -> Sequence[HandPoints]:
    if not messages:
        raise CalibrationError(
            f"{wanted.source}: has no points of a {wanted.hand} hand; are the cameras calibrated "
            "and the markers in rig.toml?"
        )
    return messages
