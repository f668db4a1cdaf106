"""Drift of the light: markers' colours against their calibrated ranges, once a second.

Pure. A blob holds only cells within its range, so each marker's patch is grown from its middle
without regard to the range. Drift is reported, with the range that would fit now, and never
followed: a range that adapts by itself ends on the colour of a shirt. A colour that has left its
range altogether is not seen, and nothing is reported of it but that its marker is missing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rhot.files.calibration import ColorRange, Colors
from rhot.messages import Marker
from services.pi_tracker.colors.pointer import MIN_CELLS
from services.pi_tracker.colors.region_growing import grow_region
from services.pi_tracker.detect.hsv_range import hue_centre, hue_width
from services.pi_tracker.image.chroma import Cells, cells_in
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.hue import hue_difference, mean_hue
from services.pi_tracker.image.yuv_planes import picture

# One observation takes 0.3 ms a marker on a desktop; light changes in seconds.
PERIOD_NS = 1_000_000_000
# Observations that are judged together: a finger in the shade for a few seconds is no drift.
_WINDOW, _MIN_OBSERVATIONS = 20, 6
# Ambiguous markers may be something else.
_MIN_QUALITY = 0.3
# Typical hue this far from the middle of its range, in half widths of it, or this share of a patch
# outside. Measured: with white balance turned, markers are first lost at 0.8 and at half of a
# patch; without drift, in simulated and real video, 0.4 and 0.26 were the most.
_MAX_HUE_OFFSET, _MAX_OUTSIDE = 0.55, 0.35
# Over once it is clearly less, or it would come and go with every cloud.
_OVER = 0.85
# What a suggested range leaves below what is seen now; as bounds.py does.
_SATURATION_SHARE, _VALUE_SHARE, _MIN_LEVEL = 0.65, 0.5, 25.0
# Quantiles of a patch's saturation and value: highlights, rims and dark sides lie below.
_LOW_SATURATION, _LOW_VALUE = 0.1, 0.05


@dataclass(frozen=True)
class Observation:
    """One marker's patch: its mean hue, low quantiles of saturation and value.

    outside is the share of its cells outside the range.
    """

    hue: float
    saturation: float
    value: float
    outside: float


@dataclass(frozen=True)
class Drifted:
    """A colour that has drifted, and the range that fits now.

    hue_off is the offset of its hue in half widths of its range, outside the share outside.
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
            f"colour {self.color!r} of camera {camera!r} has drifted: {100 * self.outside:.0f} % "
            f"of its marker lie outside its range (hue {self.hue_off:+.1f} half widths off); "
            f"has the light changed? Range that fits now: {low} to {high}; "
            f"calibrate anew with `rhot calibrate colors {camera}`"
        )


class DriftMonitor:
    """Observes the colours of one camera's markers against the ranges in use."""

    def __init__(self, colors: Mapping[str, ColorRange] | Colors) -> None:
        self._ranges = dict(colors.colors if isinstance(colors, Colors) else colors)
        self._observations: dict[str, deque[Observation]] = {}
        self._due_ns = 0
        self._told: set[str] = set()

    def update(self, frame: Frame, markers: Sequence[Marker]) -> bool:
        """Take in one frame if a second has passed; whether it did."""
        # A clock that was set back counts as due.
        if 0 <= self._due_ns - frame.stamp_ns <= PERIOD_NS:
            return False
        self._due_ns = frame.stamp_ns + PERIOD_NS
        for marker in markers:
            if marker.color in self._ranges and marker.quality >= _MIN_QUALITY:
                observation = observe(frame, marker, self._ranges[marker.color])
                if observation is not None:
                    window = self._observations.setdefault(marker.color, deque(maxlen=_WINDOW))
                    window.append(observation)
        return True

    def values(self) -> dict[str, float]:
        """For health: `<colour>_hue_off` and `<colour>_outside`.

        The first in half widths of the range, signed; the second as share of the patch.
        """
        found: dict[str, float] = {}
        for color in self._observations:
            hue_off, outside = self._typical(color)
            found |= {f"{color}_hue_off": round(hue_off, 2), f"{color}_outside": round(outside, 2)}
        return found

    def drifted(self) -> list[Drifted]:
        """Colours that a person should calibrate anew."""
        found = []
        for color, observations in self._observations.items():
            hue_off, outside = self._typical(color)
            share = _OVER if color in self._told else 1.0
            off = abs(hue_off) > share * _MAX_HUE_OFFSET or outside > share * _MAX_OUTSIDE
            if off and len(observations) >= _MIN_OBSERVATIONS:
                suggested = _suggested(self._ranges[color], observations)
                found.append(Drifted(color, round(hue_off, 2), round(outside, 2), suggested))
        self._told = {one.color for one in found}
        return found

    def _typical(self, color: str) -> tuple[float, float]:
        """Medians of the hue's offset, in half widths of the range, and of the share outside."""
        observations = self._observations[color]
        middle, half_width = _hue_middle(self._ranges[color])
        hue_off = float(np.median([hue_difference(one.hue, middle) for one in observations]))
        return hue_off / half_width, float(np.median([one.outside for one in observations]))


def observe(frame: Frame, marker: Marker, color_range: ColorRange) -> Observation | None:
    """The patch about a marker, None if there is too little of it."""
    image = picture(frame)
    # A patch of the same area at an aspect of 3 still lies inside.
    reach = round(marker.area_px**0.5) // 2 + 3
    # Of a marker that the picture's edge cuts the middle may be outside.
    x, y = (
        min(max(round(of_px / 2.0), 0), cells - 1)
        for of_px, cells in zip((marker.x_px, marker.y_px), image.size, strict=True)
    )
    x0, y0 = max(x - reach, 0), max(y - reach, 0)
    x1, y1 = min(x + reach + 1, image.size[0]), min(y + reach + 1, image.size[1])
    if x1 - x0 < 3 or y1 - y0 < 3:
        return None
    return _observe_patch(cells_in(image, (x0, y0, x1, y1)), (x - x0, y - y0), color_range)


def _observe_patch(
    cells: Cells, middle: tuple[int, int], color_range: ColorRange
) -> Observation | None:
    """The patch about cell (x, y) of a window (h, w)."""
    x, y = middle
    starts = np.zeros(cells.shape, bool)
    starts[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] = True
    patch = grow_region(cells, np.median(cells[starts].chromaticity, axis=0), starts)
    if np.count_nonzero(patch) < 2 * MIN_CELLS:
        return None
    own = cells[patch]
    hue, saturation, value = own.hsv()
    inside = (
        ((hue - color_range.hsv_low[0]) % 180.0 <= hue_width(color_range) + 0.5)
        & (saturation >= color_range.hsv_low[1] - 0.5)
        & (saturation <= color_range.hsv_high[1] + 0.5)
        & (value >= color_range.hsv_low[2] - 0.5)
        & (value <= color_range.hsv_high[2] + 0.5)
    )
    return Observation(
        mean_hue(hue, own.chroma),
        float(np.quantile(saturation, _LOW_SATURATION)),
        float(np.quantile(value, _LOW_VALUE)),
        1.0 - float(inside.mean()),
    )


def _hue_middle(color_range: ColorRange) -> tuple[float, float]:
    """Middle hue of a range, and half its width."""
    return hue_centre(color_range) % 180.0, max(hue_width(color_range) / 2.0, 1.0)


def _suggested(color_range: ColorRange, observations: Sequence[Observation]) -> ColorRange:
    """The range moved to where the colour is now, as wide as it was."""
    middle, half_width = _hue_middle(color_range)
    hue = middle + float(np.median([hue_difference(one.hue, middle) for one in observations]))
    seen_saturation = float(np.median([one.saturation for one in observations]))
    seen_value = float(np.median([one.value for one in observations]))
    saturation = min(
        float(color_range.hsv_low[1]), max(_MIN_LEVEL, _SATURATION_SHARE * seen_saturation)
    )
    value = min(float(color_range.hsv_low[2]), max(_MIN_LEVEL, _VALUE_SHARE * seen_value))
    return ColorRange(
        hsv_low=(round(hue - half_width) % 180, round(saturation), round(value)),
        hsv_high=(
            round(hue + half_width) % 180,
            color_range.hsv_high[1],
            color_range.hsv_high[2],
        ),
    )
