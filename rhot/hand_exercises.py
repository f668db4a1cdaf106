"""The guided recording of a hand: which exercises, in which order, how long.

One table for `rhot calibrate hand` and the simulator's scene `guided`. Each exercise takes
EXERCISE_S; the hand is open at its beginning and at its end. Pure data.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from rhot.hand import DIGITS

# Two calm movements to and fro; 12 exercises make 48 s.
EXERCISE_S = 4.0

Kind = Literal["open", "spread", "knuckle", "hook", "thumb", "fist"]


class Exercise(NamedTuple):
    """One exercise: digit is the row in DIGITS that moves, -1 if all or none do."""

    name: str
    kind: Kind
    digit: int
    prompt: str


EXERCISES: tuple[Exercise, ...] = (
    Exercise("open", "open", -1, "open hand: stretch all fingers and hold still"),
    Exercise("spread", "spread", -1, "spread the fingers and close them again, twice"),
    *(
        exercise
        for row, digit in enumerate(DIGITS[1:], 1)
        for exercise in (
            Exercise(
                f"{digit}_knuckle",
                "knuckle",
                row,
                f"{digit} finger: bend it at the knuckle, kept straight, twice; hold the others",
            ),
            Exercise(
                f"{digit}_hook",
                "hook",
                row,
                f"{digit} finger: roll in its two last joints, knuckle straight, twice; "
                "hold the others",
            ),
        )
    ),
    Exercise("thumb", "thumb", 0, "thumb: bend its two last joints, twice; hold the fingers"),
    Exercise("fist", "fist", -1, "make a fist and open it, twice"),
)
CYCLE_S = EXERCISE_S * len(EXERCISES)
