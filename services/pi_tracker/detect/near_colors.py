"""What is nearly a paint's colour: ranges a little wider than those that were calibrated. Pure.

A paint's hue turns by some degrees between poses and lamps, and grows pale at its rim and in blur.
A range that had all of that everywhere in the picture would have other things as well; beside paint
that lies within the range it has the rest of that paint (measure/grown_blob.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.detect.color_table import ColorTable, compile_colors
from services.pi_tracker.detect.hsv_range import hue_centre, hue_width
from services.pi_tracker.image.hue import hue_difference

# Hues beyond either end, at most, and which share of the least saturation and value. Tuning half of
# the other renderer, what a marker's centre jumps by from frame to frame, of a grasp and of a hand
# that rolls, before skin was kept away from: .83 and .22 px without, .19 and .09 so, .20 and .09
# with 8 hues, .47 and .09 with 12, .26 and .13 with 8 hues and no paler, .27 and .08 with 8 and .7.
_HUES, _SHARE = 5, 0.85
# Skin's hues; and of paint that is so near to them, no paler cells are taken.
_SKIN, _SKINLIKE = ColorRange(hsv_low=(0, 0, 0), hsv_high=(20, 255, 255)), 12


class NearTables(NamedTuple):
    """What is nearly the colours, each cell the nearest's; and what is nearly one colour, whatever
    else it may be, of each by its number whose hues another colour has as well.
    """

    all: ColorTable
    alone: dict[int, ColorTable]


def near_tables(
    colors: Colors, names: Sequence[str], path: Path | str = "colors.json"
) -> NearTables:
    """The tables of the wider ranges of named colours; errors as of compile_colors."""
    wider = near_colors(colors)
    table = compile_colors(wider, names, path)
    alone = {
        number: compile_colors(wider, [name], path)
        for number, name in enumerate(names)
        if any(
            _overlap(colors.colors[name], colors.colors[other]) for other in names if other != name
        )
    }
    return NearTables(table, alone)


def near_colors(colors: Colors) -> Colors:
    """The wider ranges of colours; none reaches beyond the middle between two paints' hues."""
    ranges = {name: _wider(name, colors.colors) for name in colors.colors}
    return Colors(date=colors.date, tool=colors.tool, colors=ranges)


def _wider(name: str, ranges: Mapping[str, ColorRange]) -> ColorRange:
    own = ranges[name]
    others = [_SKIN, *(other for key, other in ranges.items() if key != name)]
    down, up = (min([_HUES, *(gap(own, other, side) // 2 for other in others)]) for side in (-1, 1))
    # What parts paint of a hue like skin's from skin is how saturated it is.
    skinlike = min(gap(own, _SKIN, -1), gap(own, _SKIN, 1)) < _SKINLIKE
    share = 1.0 if skinlike else _SHARE
    low, saturation, value = own.hsv_low
    high, most_saturation, most_value = own.hsv_high
    return ColorRange(
        hsv_low=((low - down) % 180, round(share * saturation), round(share * value)),
        hsv_high=((high + up) % 180, most_saturation, most_value),
    )


def gap(own: ColorRange, other: ColorRange, side: int) -> int:
    """Hues between two ranges that lie beside each other on this side (-1 or 1), 90 if not."""
    apart = side * float(hue_difference(hue_centre(other), hue_centre(own)))
    if apart <= 0.0:
        return 90
    return max(round(apart - 0.5 * (hue_width(own) + hue_width(other))) - 1, 0)


def _overlap(one: ColorRange, other: ColorRange) -> bool:
    """Whether two ranges have hues in common."""
    apart = abs(float(hue_difference(hue_centre(other), hue_centre(one))))
    return apart <= 0.5 * (hue_width(one) + hue_width(other))
