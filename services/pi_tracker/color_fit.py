"""HSV ranges of paints from patches that a person pointed at, held against skin, background and each other. Pure.

Each bound lies between what was seen of the paint and the nearest of what it must not take, no further out than shade and noise need:
a hue by quantiles and a margin, saturation and value as low as shade goes. Only pictures in which a colour was pointed at say what is
not that colour: elsewhere its marker may be in view, too. A paint that cannot be told apart still gets a range, and the report says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from rhot.calibration import ColorRange
from rhot.errors import CalibrationError
from services.pi_tracker.chroma import Array, Cells, Mask, cells_of, hue_from, joined, looks_like_skin, mean_hue
from services.pi_tracker.frame import Frame
from services.pi_tracker.swatch import Pointer, Swatch, find_swatch

# Share of a patch's cells left outside on each side of a bound: rims, highlights, and what else is no paint.
_TAIL = 0.02
# Hues beyond those quantiles: another pose, a little less light. Simulated paints turn by 2 to 3 between poses; half of the distance
# to a neighbour if that is less.
_HUE_MARGIN, _LEAST_HUE_MARGIN = 5.0, 2.0
# Noise and compression move chroma by this many grey levels, and hue has 180 / 2 pi steps a radian.
_CHROMA_NOISE, _HUE_RADIAN = 2.0, 28.65
# Highlights and rims are pale: a tenth of a patch may stay outside on that side, as a blob's outline is filled.
_PALE = 0.10
# Saturation falls in motion blur, value in shade: that share of the quantiles is still taken, and, where something foreign comes near,
# at least that one is given up.
_SATURATION_SHARE, _VALUE_SHARE = (0.65, 0.92), (0.5, 0.75)
# ... but never lower: below a value of 25 hue is noise; below a saturation of 25, white balance.
_LEAST_SATURATION, _LEAST_VALUE = 25.0, 25.0
# Steps in which those bounds are raised, and how much more than the least that is foreign may stay inside.
_STEPS, _SPARE = 10, 1.5
# A bound that leaves more than this share of what is foreign inside does not help.
_USELESS = 0.3
# A foreign cell or two per picture is noise, and the tracker's filters take it away.
_STRAY_CELLS = 2.0
# Rim of a patch, in cells, that is neither paint nor background: blur, and the light that paint throws on skin.
_RIM = 3


@dataclass(frozen=True, eq=False)
class Samples:
    """What one colour is, and what it is not, in the pictures in which it was pointed at."""

    color: str
    swatches: tuple[Swatch, ...]
    paint: Cells  # (n,)
    skin: Cells  # (m,)
    room: Cells  # (k,)

    @property
    def frames(self) -> int:
        return len({swatch.frame for swatch in self.swatches})


@dataclass(frozen=True, eq=False)
class Band:
    """A range before rounding: hue as centre and bounds about it, saturation, value."""

    centre: float
    low: float
    high: float
    saturation: tuple[float, float]
    value: tuple[float, float]

    def takes(self, cells: Cells) -> Mask:
        """Which cells lie in it."""
        hue, saturation, value = cells.hsv()
        off = hue_from(hue, self.centre)
        return (
            (off >= self.low)
            & (off <= self.high)
            & (saturation >= self.saturation[0])
            & (saturation <= self.saturation[1])
            & (value >= self.value[0])
            & (value <= self.value[1])
        )

    def rounded(self) -> ColorRange:
        """As people edit it."""
        low, high = round(self.centre + self.low) % 180, round(self.centre + self.high) % 180
        return ColorRange(
            hsv_low=(low, round(self.saturation[0]), round(self.value[0])),
            hsv_high=(high, round(self.saturation[1]), round(self.value[1])),
        )


def gather(frames: Sequence[Frame], pointers: Sequence[Pointer]) -> tuple[dict[str, Samples], list[str]]:
    """The samples of every colour, and a note for each pointer that showed nothing while another of its colour did.

    frames are in the order of Pointer.frame. Raises CalibrationError if a colour has no pointer that shows it.
    """
    if not pointers:
        raise CalibrationError("nothing is pointed at; click on a marker in the picture, or give --box COLOR=x,y,width,height")
    cells = [cells_of(frame) for frame in frames]
    swatches: dict[str, list[Swatch]] = {pointer.color: [] for pointer in pointers}
    failures: dict[str, list[str]] = {}
    for pointer in pointers:
        if not 0 <= pointer.frame < len(frames):
            raise CalibrationError(f"{pointer}: there is no picture {pointer.frame}; there are {len(frames)}")
        try:
            swatches[pointer.color].append(find_swatch(cells[pointer.frame], pointer))
        except CalibrationError as error:
            failures.setdefault(pointer.color, []).append(str(error))
    for color, found in swatches.items():
        if not found:
            raise CalibrationError(failures[color][0])
    covered = [_covered([s for found in swatches.values() for s in found], number, part.shape) for number, part in enumerate(cells)]
    notes = [f"{text} (left out; the colour was found in other pictures)" for texts in failures.values() for text in texts]
    return {color: _samples(color, found, cells, covered) for color, found in swatches.items()}, notes


def _covered(swatches: Sequence[Swatch], number: int, shape: tuple[int, ...]) -> Mask:
    """Patches of one picture with their rims."""
    mask = np.zeros(shape, np.uint8)
    for swatch in swatches:
        if swatch.frame == number:
            mask |= swatch.mask.astype(np.uint8)
    return cv2.dilate(mask, np.ones((2 * _RIM + 1, 2 * _RIM + 1), np.uint8)).astype(bool)


def _samples(color: str, swatches: list[Swatch], cells: list[Cells], covered: list[Mask]) -> Samples:
    numbers = sorted({swatch.frame for swatch in swatches})
    rest = joined([cells[number][~covered[number]] for number in numbers])
    skin = looks_like_skin(rest)
    return Samples(color, tuple(swatches), joined([cells[s.frame][s.core] for s in swatches]), rest[skin], rest[~skin])


def fit(samples: Mapping[str, Samples]) -> dict[str, ColorRange]:
    """A range for every colour."""
    hues = {color: _hues(own.paint) for color, own in samples.items()}
    ranges = {}
    for color, own in samples.items():
        foreign = joined([own.skin, own.room, *(other.paint for name, other in samples.items() if name != color)])
        near = [hues[name] for name in samples if name != color]
        ranges[color] = _band(own, hues[color], near, foreign).rounded()
    return ranges


def _hues(paint: Cells) -> tuple[float, float, float]:
    """Centre of a paint's hues, and the quantiles of their distance from it; stronger colours count more, as noise turns them less."""
    hue, _, _ = paint.hsv()
    weight = paint.chroma**2
    centre = mean_hue(hue, weight)
    off = hue_from(hue, centre)
    low, high = _quantile(off, weight, _TAIL), _quantile(off, weight, 1.0 - _TAIL)
    return centre, low, high


def _quantile(values: Array, weight: Array, share: float) -> float:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][min(int(np.searchsorted(total, share * total[-1])), len(order) - 1)])


def _band(own: Samples, hues: tuple[float, float, float], near: Sequence[tuple[float, float, float]], foreign: Cells) -> Band:
    centre, low, high = hues
    low, high = low - _margin(hues, near, -1), high + _margin(hues, near, 1)
    _, saturation, value = own.paint.hsv()
    hue, foreign_saturation, foreign_value = foreign.hsv()
    off = hue_from(hue, centre)
    # The less chroma the more its noise turns the hue.
    turn = np.minimum(_CHROMA_NOISE / np.maximum(foreign.chroma, 1.0), 1.0) * _HUE_RADIAN
    alike = (off >= low - turn) & (off <= high + turn)
    stray = _STRAY_CELLS * own.frames
    palest, richest = (float(np.quantile(saturation, share)) for share in (_PALE, 1.0 - _TAIL))
    darkest = float(np.quantile(value, _TAIL))
    saturation_low, value_low = _floors(palest, darkest, foreign_saturation[alike], foreign_value[alike], stray)
    alike &= (foreign_saturation >= saturation_low) & (foreign_value >= value_low)
    return Band(centre, low, high, (saturation_low, _ceiling(richest, foreign_saturation[alike], stray)), (value_low, 255.0))


def _margin(hues: tuple[float, float, float], near: Sequence[tuple[float, float, float]], side: int) -> float:
    """How far the hues may reach beyond what was seen, on one side."""
    centre, low, high = hues
    edge = high if side > 0 else -low
    margin = _HUE_MARGIN
    for other, other_low, other_high in near:
        apart = side * float(hue_from(np.float64(other), centre))
        gap = apart + (other_low if side > 0 else -other_high) - edge
        # Behind it, or mixed with it: then hue does not part the two, and the report says so.
        if apart > 0.0 and gap > 0.0:
            margin = min(margin, gap / 2.0)
    return max(margin, min(_LEAST_HUE_MARGIN, margin + 1.0))


def _floors(palest: float, darkest: float, saturation: Array, value: Array, stray: float) -> tuple[float, float]:
    """Lower bounds of saturation and value: as low as blur and shade go, raised together no more than what is foreign makes necessary.

    saturation and value are of the foreign cells of like hue, (n,).
    """
    saturations = np.maximum(np.linspace(*_SATURATION_SHARE, _STEPS) * palest, _LEAST_SATURATION)
    values = np.maximum(np.linspace(*_VALUE_SHARE, _STEPS) * darkest, _LEAST_VALUE)
    inside = np.array([[np.count_nonzero((saturation >= s) & (value >= v)) for v in values] for s in saturations])
    least = float(inside[-1, -1])
    if inside[0, 0] <= stray or least > max(stray, _USELESS * inside[0, 0]):
        # Nothing to keep out; or it cannot be kept out, and only paint would be lost.
        return float(saturations[0]), float(values[0])
    good = inside <= max(stray, _SPARE * least)
    effort = np.add.outer(np.arange(_STEPS), np.arange(_STEPS)).astype(np.float64)
    i, j = np.unravel_index(int(np.argmin(np.where(good, effort, np.inf))), good.shape)
    # A step more, as the next picture's noise is another.
    return float(saturations[min(i + 1, _STEPS - 1)] if i else saturations[0]), float(values[j])


def _ceiling(richest: float, saturation: Array, stray: float) -> float:
    """An upper bound of saturation: none, unless most of what is foreign (n,) is more saturated than the paint and clear of it."""
    above = saturation[saturation > richest]
    if above.size <= stray or above.size < (1.0 - _USELESS) * saturation.size:
        return 255.0
    return (float(np.sort(above)[int(stray)]) + richest) / 2.0
