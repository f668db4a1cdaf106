"""Whether the light has changed since the colours were calibrated: markers' colours against their
ranges, once a second. Pure.

A blob shows only what its range lets in, so each marker's patch is grown anew from its middle,
whatever its range says. Drift is told, with the range that would fit now, and never followed: a
range that follows by itself ends on somebody's shirt. A colour that has left its range altogether
is not seen, and nothing is told of it but that its marker is missing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rhot.files.calibration import ColorRange, Colors
from rhot.messages import Marker
from services.pi_tracker.colors.paint_patch import MIN_CELLS, grow
from services.pi_tracker.image.chroma import Cells, hue_apart, mean_hue
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import picture

# One look takes 0.3 ms a marker on a desktop; light changes in seconds.
PERIOD_NS = 1_000_000_000
# Looks that are judged together: a finger in the shade for a few seconds is no drift.
_LOOKS, _LEAST_LOOKS = 20, 6
# Ambiguous markers may be something else.
_LEAST_QUALITY = 0.3
# Typical hue this far from the middle of its range, in half widths of it, or this share of a patch
# outside. Measured: with white balance turned, markers are first lost at 0.8 and at half of a
# patch; without drift, in simulated and real video, 0.4 and 0.26 were the most.
_HUE_OFF, _OUTSIDE = 0.55, 0.35
# What a suggested range leaves below what is seen now; as color_fit.py.
_SATURATION_SHARE, _VALUE_SHARE, _LEAST = 0.65, 0.5, 25.0


@dataclass(frozen=True)
class Look:
    """One marker's patch: its mean hue, low quantiles of saturation and value, and the share of its
    cells outside the range.
    """

    hue: float
    saturation: float
    value: float
    outside: float


@dataclass(frozen=True)
class Drifted:
    """A colour that has drifted: how far its hue is off in half widths of its range, the share
    outside, and the range that fits now.
    """

    color: str
    hue_off: float
    outside: float
    suggested: ColorRange

    def text(self, camera: str) -> str:
        """For a person."""
        low, high = (
            ",".join(map(str, bound)) for bound in (self.suggested.hsv_low, self.suggested.hsv_high)
        )
        return (
            f"colour {self.color!r} of camera {camera!r} has drifted: {100 * self.outside:.0f} % of its marker lie outside its range"
            f" (hue {self.hue_off:+.1f} half widths off); has the light changed? Range that fits now: {low} to {high}; "
            f"calibrate anew with `rhot calibrate colors {camera}`"
        )


class Drift:
    """Follows the colours of one camera's markers against the ranges in force."""

    def __init__(self, colors: Mapping[str, ColorRange] | Colors) -> None:
        self._ranges = dict(colors.colors if isinstance(colors, Colors) else colors)
        self._looks: dict[str, deque[Look]] = {}
        self._due_ns = 0

    def look(self, frame: Frame, markers: Sequence[Marker]) -> bool:
        """Take in one frame if a second has passed; whether it did."""
        # A clock that was set back counts as due.
        if 0 <= self._due_ns - frame.stamp_ns <= PERIOD_NS:
            return False
        self._due_ns = frame.stamp_ns + PERIOD_NS
        for marker in markers:
            if marker.color in self._ranges and marker.quality >= _LEAST_QUALITY:
                seen = look_at(frame, marker, self._ranges[marker.color])
                if seen is not None:
                    self._looks.setdefault(marker.color, deque(maxlen=_LOOKS)).append(seen)
        return True

    def values(self) -> dict[str, float]:
        """`<colour>_hue_off` (half widths of the range, signed) and `<colour>_outside` (share of
        the patch), for health.
        """
        found: dict[str, float] = {}
        for color in self._looks:
            hue_off, outside = self._typical(color)
            found |= {f"{color}_hue_off": round(hue_off, 2), f"{color}_outside": round(outside, 2)}
        return found

    def drifted(self) -> list[Drifted]:
        """Colours that a person should calibrate anew."""
        found = []
        for color, looks in self._looks.items():
            hue_off, outside = self._typical(color)
            if len(looks) >= _LEAST_LOOKS and (abs(hue_off) > _HUE_OFF or outside > _OUTSIDE):
                found.append(
                    Drifted(
                        color,
                        round(hue_off, 2),
                        round(outside, 2),
                        _suggested(self._ranges[color], looks),
                    )
                )
        return found

    def _typical(self, color: str) -> tuple[float, float]:
        looks = self._looks[color]
        middle, half = _middle(self._ranges[color])
        return float(np.median([hue_apart(one.hue, middle) for one in looks])) / half, float(
            np.median([one.outside for one in looks])
        )


def look_at(frame: Frame, marker: Marker, span: ColorRange) -> Look | None:
    """The patch about a marker, None if there is too little of it."""
    image = picture(frame)
    # A patch of the same area at an aspect of 3 still lies inside.
    reach = round(marker.area_px**0.5) // 2 + 3
    x, y = round(marker.x_px / 2.0), round(marker.y_px / 2.0)
    x0, y0 = max(x - reach, 0), max(y - reach, 0)
    x1, y1 = min(x + reach + 1, image.size[0]), min(y + reach + 1, image.size[1])
    if x1 - x0 < 3 or y1 - y0 < 3:
        return None
    luma, chroma = image.cells((x0, y0, x1, y1))
    cells = Cells(
        luma.astype(np.float64) - 16.0,
        chroma[..., 0].astype(np.float64) - 128.0,
        chroma[..., 1].astype(np.float64) - 128.0,
    )
    middle = np.zeros(cells.shape, bool)
    middle[max(y - y0 - 1, 0) : y - y0 + 2, max(x - x0 - 1, 0) : x - x0 + 2] = True
    patch = grow(cells, np.median(cells[middle].tint, axis=0), middle)
    if np.count_nonzero(patch) < 2 * MIN_CELLS:
        return None
    own = cells[patch]
    hue, saturation, value = own.hsv()
    off = (hue - span.hsv_low[0]) % 180.0
    inside = (
        (off <= (span.hsv_high[0] - span.hsv_low[0]) % 180 + 0.5)
        & (saturation >= span.hsv_low[1] - 0.5)
        & (saturation <= span.hsv_high[1] + 0.5)
        & (value >= span.hsv_low[2] - 0.5)
        & (value <= span.hsv_high[2] + 0.5)
    )
    return Look(
        mean_hue(hue, own.chroma),
        float(np.quantile(saturation, 0.1)),
        float(np.quantile(value, 0.05)),
        1.0 - float(inside.mean()),
    )


def _middle(span: ColorRange) -> tuple[float, float]:
    """Middle hue of a range, and half its width."""
    width = (span.hsv_high[0] - span.hsv_low[0]) % 180
    return (span.hsv_low[0] + width / 2.0) % 180.0, max(width / 2.0, 1.0)


def _suggested(span: ColorRange, looks: Sequence[Look]) -> ColorRange:
    """The range moved to where the colour is now, as wide as it was."""
    middle, half = _middle(span)
    hue = middle + float(np.median([hue_apart(look.hue, middle) for look in looks]))
    saturation = min(
        float(span.hsv_low[1]),
        max(_LEAST, _SATURATION_SHARE * float(np.median([look.saturation for look in looks]))),
    )
    value = min(
        float(span.hsv_low[2]),
        max(_LEAST, _VALUE_SHARE * float(np.median([look.value for look in looks]))),
    )
    return ColorRange(
        hsv_low=(round(hue - half) % 180, round(saturation), round(value)),
        hsv_high=(round(hue + half) % 180, span.hsv_high[1], span.hsv_high[2]),
    )
