"""The bounds of one colour's range, between what was seen of the paint and what it must not take.
Pure.

Bounds lie as far out as another pose, shade and blur need, and are drawn in only where that keeps
out something foreign: saturation and value, then hue. What cannot be kept out, as a shirt of the
same colour, costs no paint: bounds that would not help stay wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhot.files.calibration import ColorRange
from services.pi_tracker.image.chroma import Array, Cells, hue_apart, hue_from, mean_hue

# Share of a patch's cells left outside on each side of a bound: rims, highlights, and what else is
# no paint.
_TAIL = 0.02
# Hues beyond those quantiles: another pose, a little less light. Simulated paints turn by 2 to 3
# between poses; half of the distance to a neighbour if that is less.
_HUE_MARGIN, _LEAST_HUE_MARGIN = 5.0, 2.0
# Drawn in, hues end at a quantile of so much; more of the paint would be lost than blobs can spare.
_HUE_TAIL = 0.10
# A marker's hues never spread over more than this to each side of their middle; what does is two
# things.
_WIDEST = 70.0
# Noise and compression move chroma by this many grey levels, and hue has 180 / 2 pi steps a radian.
_CHROMA_NOISE, _HUE_RADIAN = 2.0, 28.65
# Highlights and rims are pale: a tenth of a patch may stay outside on that side, as a blob's
# outline is filled.
_PALE = 0.10
# Saturation falls in motion blur, value in shade: that share of the quantiles is still taken, and,
# where something foreign comes near, at least that one is given up.
_SATURATION_SHARE, _VALUE_SHARE = (0.65, 0.92), (0.5, 0.75)
# ... but never lower: below a value of 25 hue is noise; below a saturation of 25, white balance.
_LEAST_SATURATION, _LEAST_VALUE = 25.0, 25.0
# Steps in which bounds are drawn in, which share of what could be kept out may stay inside, and how
# many steps more are taken.
_STEPS, _SPARE, _CLEARANCE = 10, 0.15, 2
# Bounds of hue that keep out less than this share do not help: grey noise has all hues.
_HELP = 0.5
# An upper bound that leaves more than this share of what is foreign inside does not help.
_USELESS = 0.3
# One foreign cell per picture is noise, and the tracker's filters take it away.
_STRAY_CELLS = 1.0


@dataclass(frozen=True)
class Hues:
    """A paint's hues: middle, and quantiles of their distance from it (the inner ones leave more
    outside).
    """

    middle: float
    low: float
    high: float
    inner_low: float
    inner_high: float


def hues_of(paint: Cells) -> Hues:
    """Hues of cells (n,), at least one; stronger colours count more, as noise turns them less."""
    hue, _, _ = paint.hsv()
    weight = paint.chroma**2 + 1e-9
    middle = mean_hue(hue, weight)
    off = np.clip(hue_from(hue, middle), -_WIDEST, _WIDEST)
    order = np.argsort(off)
    share = np.cumsum(weight[order]) / np.sum(weight)
    low, inner_low, inner_high, high = (
        float(off[order][min(int(np.searchsorted(share, at)), len(order) - 1)])
        for at in (_TAIL, _HUE_TAIL, 1.0 - _HUE_TAIL, 1.0 - _TAIL)
    )
    return Hues(middle, low, high, inner_low, inner_high)


def bounds(
    paint: Cells, hues: Hues, near: Sequence[Hues], foreign: Cells, pictures: int
) -> ColorRange:
    """The range of a paint (n,) against foreign cells (m,) of as many pictures.

    Near are the other paints' hues.
    """
    return _Fit(paint, hues, near, foreign, _STRAY_CELLS * pictures).range()


class _Fit:
    def __init__(
        self, paint: Cells, hues: Hues, near: Sequence[Hues], foreign: Cells, stray: float
    ) -> None:
        self._hues, self._stray = hues, stray
        _, saturation, value = paint.hsv()
        self._palest, self._richest = (
            float(np.quantile(saturation, share)) for share in (_PALE, 1.0 - _TAIL)
        )
        self._darkest = float(np.quantile(value, _TAIL))
        foreign_hue, self._saturation, self._value = foreign.hsv()
        self._off = hue_from(foreign_hue, hues.middle)
        # The less chroma the more its noise turns the hue.
        self._turn = np.minimum(_CHROMA_NOISE / np.maximum(foreign.chroma, 1.0), 1.0) * _HUE_RADIAN
        self._widest = hues.low - _margin(hues, near, -1), hues.high + _margin(hues, near, 1)

    def range(self) -> ColorRange:
        """Saturation and value first; where they leave something, hue.

        Then as wide in the former as that allows.
        """
        low, high = self._widest
        floors = self._floors(low, high)
        if np.count_nonzero(self._inside(low, high, *floors)) > self._stray:
            low, high = self._hue_bounds(*floors)
            floors = self._floors(low, high)
        saturation_high = self._ceiling(self._saturation[self._inside(low, high, *floors)])
        middle = self._hues.middle
        return ColorRange(
            hsv_low=(round(middle + low) % 180, round(floors[0]), round(floors[1])),
            hsv_high=(round(middle + high) % 180, round(saturation_high), 255),
        )

    def _inside(self, low: float, high: float, saturation_low: float, value_low: float) -> Array:
        """Which foreign cells lie in a range, or may in the next picture."""
        alike = (self._off >= low - self._turn) & (self._off <= high + self._turn)
        return alike & (self._saturation >= saturation_low) & (self._value >= value_low)

    def _floors(self, low: float, high: float) -> tuple[float, float]:
        """Lower bounds of saturation and value: as low as blur and shade go, raised no more than
        what is foreign makes necessary.
        """
        saturations = np.maximum(
            np.linspace(*_SATURATION_SHARE, _STEPS) * self._palest, _LEAST_SATURATION
        )
        values = np.maximum(np.linspace(*_VALUE_SHARE, _STEPS) * self._darkest, _LEAST_VALUE)
        alike = self._inside(low, high, float(saturations[0]), float(values[0]))
        saturation, value = self._saturation[alike], self._value[alike]
        inside = np.array(
            [
                [np.count_nonzero((saturation >= s) & (value >= v)) for v in values]
                for s in saturations
            ]
        )
        if inside[0, 0] <= self._stray:
            return float(saturations[0]), float(values[0])
        good = inside <= max(self._stray, inside[-1, -1] + _SPARE * (inside[0, 0] - inside[-1, -1]))
        effort = np.add.outer(np.arange(_STEPS), np.arange(_STEPS)).astype(np.float64)
        i, j = divmod(int(np.argmin(np.where(good, effort, np.inf))), _STEPS)
        # A little more, as the next picture's noise is another.
        return float(saturations[min(i + _CLEARANCE, _STEPS - 1)]), float(values[j])

    def _hue_bounds(self, saturation_low: float, value_low: float) -> tuple[float, float]:
        """Bounds of hue, each drawn in if that keeps out most of what is foreign on its side."""
        strong = self._inside(*self._widest, saturation_low, value_low)
        off, turn = self._off[strong], self._turn[strong]
        found = []
        for widest, tightest, side in zip(
            self._widest, (self._hues.inner_low, self._hues.inner_high), (-1.0, 1.0), strict=True
        ):
            steps = np.linspace(widest, tightest, _STEPS)
            beyond = side * off > 0.0
            inside = np.array(
                [np.count_nonzero(beyond & (side * off - turn <= side * step)) for step in steps]
            )
            if inside[0] <= self._stray or inside[-1] > (1.0 - _HELP) * inside[0]:
                found.append(widest)
                continue
            good = inside <= max(self._stray, inside[-1] + _SPARE * (inside[0] - inside[-1]))
            found.append(float(steps[int(np.argmax(good))]))
        return found[0], found[1]

    def _ceiling(self, saturation: Array) -> float:
        """An upper bound of saturation: none, unless most of what is foreign (n,) is more saturated
        than the paint and clear of it.
        """
        above = saturation[saturation > self._richest]
        if above.size <= self._stray or above.size < (1.0 - _USELESS) * saturation.size:
            return 255.0
        return (float(np.sort(above)[int(self._stray)]) + self._richest) / 2.0


def _margin(hues: Hues, near: Sequence[Hues], side: int) -> float:
    """How far the hues may reach beyond what was seen, on one side."""
    edge = hues.high if side > 0 else -hues.low
    margin = _HUE_MARGIN
    for other in near:
        apart = side * hue_apart(other.middle, hues.middle)
        gap = apart + (other.low if side > 0 else -other.high) - edge
        # Behind it, or mixed with it: then hue does not part the two, and the report says so.
        if apart > 0.0 and gap > 0.0:
            margin = min(margin, gap / 2.0)
    return max(margin, min(_LEAST_HUE_MARGIN, margin + 1.0))
