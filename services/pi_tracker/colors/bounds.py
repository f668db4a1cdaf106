"""The HSV bounds of one colour, between the cells seen of its paint and what it must not take.

Pure. Bounds are as wide as another pose, shade and blur need, and are tightened only where that
keeps out foreign cells: saturation and value first, then hue. What cannot be kept out, as a shirt
of the same colour, costs no paint: bounds that would not help stay wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhot.files.calibration import ColorRange
from services.pi_tracker.image.chroma import Cells
from services.pi_tracker.image.hue import Array, hue_difference, mean_hue

# Share of a patch's cells left outside on each side of a bound: rims, highlights, and what else is
# no paint.
_TAIL = 0.02
# Hues beyond those quantiles: another pose, a little less light. Simulated paints turn by 2 to 3
# between poses; half of the distance to a neighbour if that is less.
_HUE_MARGIN, _MIN_HUE_MARGIN = 5.0, 2.0
# Tightened, hues end at a quantile of so much; more of the paint would be lost than blobs can
# spare.
_HUE_TAIL = 0.10
# A marker's hues never spread over more than this to each side of their middle; hues that do are
# those of two objects.
_MAX_HUE_SPREAD = 70.0
# Noise and compression move chroma by this many grey levels, and hue has 180 / 2 pi steps a radian.
_CHROMA_NOISE, _HUES_PER_RADIAN = 2.0, 28.65
# Highlights and rims are pale: a tenth of a patch may stay outside on that side, as a blob's
# outline is filled.
_PALE_TAIL = 0.10
# Saturation falls in motion blur, value in shade. A lower bound is this share of the quantile: the
# first if possible, up to the second where foreign cells come near.
_SATURATION_SHARE, _VALUE_SHARE = (0.65, 0.92), (0.5, 0.75)
# ... but never lower: below a value of 25 hue is noise; below a saturation of 25, white balance.
_MIN_SATURATION, _MIN_VALUE = 25.0, 25.0
# Steps in which bounds are tightened, which share of what could be kept out may stay inside, and
# how many steps more are taken.
_STEPS, _TOLERATED_SHARE, _CLEARANCE_STEPS = 10, 0.15, 2
# Bounds of hue that keep out less than this share do not help: grey noise has all hues.
_MIN_HUE_GAIN = 0.5
# An upper bound that leaves more than this share of the foreign cells inside does not help.
_MAX_LEFT_INSIDE = 0.3
# One foreign cell per picture is noise, and the tracker's filters take it away.
_STRAY_CELLS = 1.0
# Foreign cells that are fewer than such a share of the paint's own are not worth narrower hues:
# another pose's would be left outside. (24 tuning rooms with clicks on the paint: of a violet dab
# with 54 such cells in five pictures a range of four hues was left, and a third of its markers was
# lost; .6 and 1 change nothing else, with 2 another colour takes a poster.)
_FEW_SHARE = 0.6


@dataclass(frozen=True)
class Hues:
    """A paint's hues: middle, and quantiles of their difference from it.

    The inner quantiles leave more of the paint outside.
    """

    middle: float
    low: float
    high: float
    inner_low: float
    inner_high: float


def hues_of(paint: Cells) -> Hues:
    """Hues of cells (n,), at least one.

    Stronger colours have more weight, as noise turns their hue less.
    """
    hue, _, _ = paint.hsv()
    weight = paint.chroma**2 + 1e-9
    middle = mean_hue(hue, weight)
    difference = np.clip(hue_difference(hue, middle), -_MAX_HUE_SPREAD, _MAX_HUE_SPREAD)
    order = np.argsort(difference)
    cumulative = np.cumsum(weight[order]) / np.sum(weight)
    low, inner_low, inner_high, high = (
        float(difference[order][min(int(np.searchsorted(cumulative, share)), len(order) - 1)])
        for share in (_TAIL, _HUE_TAIL, 1.0 - _HUE_TAIL, 1.0 - _TAIL)
    )
    return Hues(middle, low, high, inner_low, inner_high)


def bounds(
    paint: Cells, hues: Hues, neighbours: Sequence[Hues], foreign: Cells, pictures: int
) -> ColorRange:
    """The range of a paint (n,) against foreign cells (m,) of as many pictures.

    neighbours are the other paints' hues.
    """
    return _BoundsFit(paint, hues, neighbours, foreign, _STRAY_CELLS * pictures).range()


class _BoundsFit:
    """Foreign cells (m,) relative to one paint, and the bounds that keep them out."""

    def __init__(
        self,
        paint: Cells,
        hues: Hues,
        neighbours: Sequence[Hues],
        foreign: Cells,
        stray_cells: float,
    ) -> None:
        self._hues, self._stray = hues, stray_cells
        self._few_cells = max(stray_cells, _FEW_SHARE * paint.y.size)
        _, saturation, value = paint.hsv()
        self._pale = float(np.quantile(saturation, _PALE_TAIL))
        self._saturated = float(np.quantile(saturation, 1.0 - _TAIL))
        self._dark = float(np.quantile(value, _TAIL))
        foreign_hue, self._saturation, self._value = foreign.hsv()
        self._difference = hue_difference(foreign_hue, hues.middle)
        # The less chroma the more its noise turns the hue.
        noise_rad = np.minimum(_CHROMA_NOISE / np.maximum(foreign.chroma, 1.0), 1.0)
        self._hue_noise = noise_rad * _HUES_PER_RADIAN
        self._widest = (
            hues.low - _hue_margin(hues, neighbours, -1),
            hues.high + _hue_margin(hues, neighbours, 1),
        )

    def range(self) -> ColorRange:
        """Tighten saturation and value; where they leave something inside, hue.

        Then saturation and value again, as wide as the tighter hues allow.
        """
        low, high = self._widest
        floors = self._lower_bounds(low, high)
        if np.count_nonzero(self._inside(low, high, *floors)) > self._few_cells:
            low, high = self._hue_bounds(*floors)
            floors = self._lower_bounds(low, high)
        saturation_high = self._upper_bound(self._saturation[self._inside(low, high, *floors)])
        middle = self._hues.middle
        return ColorRange(
            hsv_low=(round(middle + low) % 180, round(floors[0]), round(floors[1])),
            hsv_high=(round(middle + high) % 180, round(saturation_high), 255),
        )

    def _inside(self, low: float, high: float, saturation_low: float, value_low: float) -> Array:
        """Which foreign cells (m,) lie in a range, or may in the next picture."""
        within_hues = (self._difference >= low - self._hue_noise) & (
            self._difference <= high + self._hue_noise
        )
        return within_hues & (self._saturation >= saturation_low) & (self._value >= value_low)

    def _lower_bounds(self, low: float, high: float) -> tuple[float, float]:
        """Lower bounds of saturation and value, for hues low..high about the middle.

        As low as blur and shade go, raised no more than foreign cells make necessary.
        """
        saturations = np.maximum(
            np.linspace(*_SATURATION_SHARE, _STEPS) * self._pale, _MIN_SATURATION
        )
        values = np.maximum(np.linspace(*_VALUE_SHARE, _STEPS) * self._dark, _MIN_VALUE)
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
        good = inside <= self._tolerated(inside[0, 0], inside[-1, -1])
        effort = np.add.outer(np.arange(_STEPS), np.arange(_STEPS)).astype(np.float64)
        i, j = divmod(int(np.argmin(np.where(good, effort, np.inf))), _STEPS)
        # A little more, as the next picture's noise is another.
        return float(saturations[min(i + _CLEARANCE_STEPS, _STEPS - 1)]), float(values[j])

    def _tolerated(self, widest: float, tightest: float) -> float:
        """How many foreign cells may stay inside, given how many the extreme bounds leave."""
        return max(self._stray, tightest + _TOLERATED_SHARE * (widest - tightest))

    def _hue_bounds(self, saturation_low: float, value_low: float) -> tuple[float, float]:
        """Bounds of hue, each tightened if that keeps out most foreign cells on its side."""
        strong = self._inside(*self._widest, saturation_low, value_low)
        difference, noise = self._difference[strong], self._hue_noise[strong]
        found = []
        for widest, tightest, side in zip(
            self._widest, (self._hues.inner_low, self._hues.inner_high), (-1.0, 1.0), strict=True
        ):
            steps = np.linspace(widest, tightest, _STEPS)
            on_side = side * difference > 0.0
            inside = np.array(
                [
                    np.count_nonzero(on_side & (side * difference - noise <= side * step))
                    for step in steps
                ]
            )
            if inside[0] <= self._few_cells or inside[-1] > (1.0 - _MIN_HUE_GAIN) * inside[0]:
                found.append(widest)
                continue
            good = inside <= self._tolerated(inside[0], inside[-1])
            found.append(float(steps[int(np.argmax(good))]))
        return found[0], found[1]

    def _upper_bound(self, saturation: Array) -> float:
        """An upper bound of saturation, given that of the foreign cells inside (n,).

        None (255), unless most of them are more saturated than the paint and clear of it.
        """
        above = saturation[saturation > self._saturated]
        if above.size <= self._stray or above.size < (1.0 - _MAX_LEFT_INSIDE) * saturation.size:
            return 255.0
        return (float(np.sort(above)[int(self._stray)]) + self._saturated) / 2.0


def _hue_margin(hues: Hues, neighbours: Sequence[Hues], side: int) -> float:
    """How far the hues may reach beyond what was seen, on one side."""
    edge = hues.high if side > 0 else -hues.low
    margin = _HUE_MARGIN
    for other in neighbours:
        apart = side * hue_difference(other.middle, hues.middle)
        gap = apart + (other.low if side > 0 else -other.high) - edge
        # Behind it, or mixed with it: then hue does not part the two, and the report says so.
        if apart > 0.0 and gap > 0.0:
            margin = min(margin, gap / 2.0)
    return max(margin, min(_MIN_HUE_MARGIN, margin + 1.0))
