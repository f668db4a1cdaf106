"""The charts there are: their names in the list, their lines, their scale. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from rhot.files.config import RigConfig
from rhot.hand import DIGIT_ANGLES, DIGITS
from services.viewer.plots.history import angle_name, delay_name, rate_name

# What a digit's four angles are to a person, from the palm to the tip.
JOINT_WORDS = ("spread", "base", "middle", "tip")
# Told apart also with red-green blindness (Okabe and Ito).
COLORS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00")
# Fingers bend from 30 degrees back to 110 forward (rhot/hand_tables.py), the thumb's joints less.
_ANGLES = (-40.0, 120.0)


@dataclass(frozen=True)
class Chart:
    """One chart: series as (name in the history, words), and the scale, None for what fits."""

    title: str
    unit: str
    series: tuple[tuple[str, str], ...]
    scale: tuple[float, float] | None = None


def charts(config: RigConfig) -> dict[str, Chart]:
    """Every chart of a rig, by what it is called in the list."""
    found = {}
    for hand in config.hand:
        for digit, angles in zip(DIGITS, DIGIT_ANGLES, strict=True):
            title = f"{hand} {digit}" if digit == "thumb" else f"{hand} {digit} finger"
            lines = zip(angles, JOINT_WORDS, strict=True)
            series = tuple((angle_name(hand, digit, angle), words) for angle, words in lines)
            found[f"joints: {title}"] = Chart(title, "degrees", series, _ANGLES)
    if config.hand:
        delays = tuple((delay_name(hand), f"{hand} hand") for hand in config.hand)
        found["delay of the poses"] = Chart("from the light to the pose", "ms", delays)
    sources = [*(c.name for c in config.camera), *(f"{hand} hand" for hand in config.hand)]
    if sources:
        rates = tuple((rate_name(what), what) for what in sources)
        found["messages a second"] = Chart("messages a second", "1/s", rates)
    return found
