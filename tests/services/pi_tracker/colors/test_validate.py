"""Ranges that cannot be applied."""

from __future__ import annotations

import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.colors.validate import check_colors

GOOD = ColorRange(hsv_low=(170, 60, 40), hsv_high=(10, 255, 255))


def test_what_is_complete_passes():
    check_colors(Colors(colors={"red": GOOD, "blue": GOOD}), ["red"])
    check_colors(Colors(colors={"red": GOOD}), [])


@pytest.mark.parametrize(
    ("colors", "message"),
    [
        ({}, "no colour in it"),
        (
            {"red": GOOD},
            "'green' of rig.toml's markers, which is tracked, would be lost; it has red",
        ),
        (
            {"green": ColorRange(hsv_low=(0, 200, 40), hsv_high=(9, 100, 255))},
            "lowest saturation, 200, is above its highest, 100",
        ),
        ({"green": ColorRange(hsv_low=(0, 20, 90), hsv_high=(9, 100, 80))}, "lowest value, 90"),
        ({"green": GOOD, "a b": GOOD}, "'a b' cannot name a colour"),
        ({"green": GOOD, "x" * 5000: GOOD}, "cannot name a colour"),
        ({f"c{k}": GOOD for k in range(65)}, "65 colours are in it, at most 64"),
    ],
)
def test_what_is_wrong_is_named(colors, message):
    with pytest.raises(CalibrationError, match=message):
        check_colors(Colors(colors=colors), ["green"])
