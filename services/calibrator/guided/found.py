"""What a step of a guided calibration gives. Pure data."""

from __future__ import annotations

from dataclasses import dataclass, field

import msgspec

from rhot.messages.calibration import CalibrationFigure


@dataclass(frozen=True)
class Found:
    """Files by name, in the order in which they are written; whether they are good; what they say.

    advice is what to do about it, most urgent first. only_good: it is not saved unless it is good.
    """

    files: dict[str, msgspec.Struct]
    good: bool
    figures: list[CalibrationFigure]
    advice: list[str] = field(default_factory=list)
    only_good: bool = False


def figure(name: str, value: str) -> CalibrationFigure:
    """One line of a report."""
    return CalibrationFigure(name=name, value=value)
