"""Validation of colour ranges before they are applied. Pure.

Types and bounds are checked where a message is decoded. What is left are ranges that take nothing,
names no marker can have, and colours that are missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec

from rhot.errors import CalibrationError
from rhot.files.calibration import Colors
from rhot.messages import Name

# A hand has 26 joints, and there are two hands; more is a mistake, and costs the tracker.
MAX_COLORS = 64


# A calibration's statistics are tables of tables; much deeper ones end in a RecursionError.
_MAX_NESTING = 16


def check_nesting(colors: Colors) -> None:
    """Raises CalibrationError on statistics that are nested deeper than any tool writes them."""
    level: list[Any] = [colors.inputs, colors.residuals]
    for _ in range(_MAX_NESTING):
        level = [
            inner
            for one in level
            if isinstance(one, (dict, list))
            for inner in (one.values() if isinstance(one, dict) else one)
        ]
        if not level:
            return
    raise CalibrationError(f"its inputs or residuals are nested deeper than {_MAX_NESTING} levels")


def check_colors(colors: Colors, required: Sequence[str]) -> None:
    """Raises CalibrationError saying which colour is wrong, and how.

    required are colours that must be there.
    """
    check_nesting(colors)
    if not colors.colors:
        raise CalibrationError("there is no colour in it")
    if len(colors.colors) > MAX_COLORS:
        raise CalibrationError(
            f"{len(colors.colors)} colours are in it, at most {MAX_COLORS} are possible"
        )
    for name, color_range in colors.colors.items():
        try:
            msgspec.convert(name, Name)
        except msgspec.ValidationError:
            raise CalibrationError(
                f"{name[:80]!r} cannot name a colour; use letters, digits, '_', '-' and '.'"
            ) from None
        for what, low, high in zip(
            ("saturation", "value"), color_range.hsv_low[1:], color_range.hsv_high[1:], strict=True
        ):
            if low > high:
                raise CalibrationError(
                    f"colour {name!r}: its lowest {what}, {low}, is above its highest, {high}; "
                    "only hues wrap"
                )
    # Alike in detect/color_table.py: that message is for who starts a tracker, this for who sends
    # colours.
    missing = [name for name in required if name not in colors.colors]
    if missing:
        raise CalibrationError(
            f"{', '.join(map(repr, missing))} of rig.toml's markers, "
            f"which {'is' if len(missing) == 1 else 'are'} tracked, would be lost; "
            f"it has {', '.join(sorted(colors.colors))}"
        )
