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
from services.pi_tracker.chroma import Array, Cells, Mask, cells_of, hue_apart, hue_from, joined, looks_like_skin, mean_hue
from services.pi_tracker.frame import Frame
from services.pi_tracker.swatch import Pointer, Swatch, find_swatch

# Share of a patch's cells left outside on each side of a bound: rims, highlights, and what else is no paint.
_TAIL = 0.02
# One paint's hue varies no more than this between pictures; the next paint of a set of six is 20 away.
_SAME_HUE = 12.0
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
# Steps in which those bounds are raised, and which share of what could be kept out may stay inside.
_STEPS, _SPARE = 10, 0.15
# A bound that leaves more than this share of what is foreign inside does not help.
_USELESS = 0.3
# One foreign cell per picture is noise, and the tracker's filters take it away.
_STRAY_CELLS = 1.0
# Rim of a patch, in cells and as share of its size, that is neither paint nor background: blur, and the light that paint throws on skin.
_RIM, _RIM_SHARE = 3, 0.2


@dataclass(frozen=True, eq=False)
class Samples:
    """What one colour is, and what it is not, in the pictures in which it was pointed at."""

    color: str
    swatches: tuple[Swatch, ...]
    paint: Cells  # (n,)
    skin: Cells  # (m,)
    room: Cells  # (k,)

    @property
    def frames(self) -> list[int]:
        """The pictures, by number."""
        return sorted({swatch.frame for swatch in self.swatches})


@dataclass(frozen=True, eq=False)
class Study:
    """Pictures, the patches in them, and notes on pointers that were left out."""

    cells: list[Cells]  # (h, w) each
    covered: list[Mask]  # (h, w) each: patches with their rims
    samples: dict[str, Samples]
    notes: list[str]


def gather(frames: Sequence[Frame], pointers: Sequence[Pointer]) -> Study:
    """The samples of every colour; a pointer that shows nothing, or another colour than the rest, is noted and left out.

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
    notes = [f"{text} (left out: the colour was found in other pictures)" for texts in failures.values() for text in texts]
    for color, found in swatches.items():
        swatches[color], odd = _agreeing(found, cells)
        notes += [
            f"{color} in picture {s.frame}: has another hue than in the others (left out: was something else pointed at?)" for s in odd
        ]
    covered = [_covered([s for found in swatches.values() for s in found], number, part.shape) for number, part in enumerate(cells)]
    return Study(cells, covered, {color: _samples(color, found, cells, covered) for color, found in swatches.items()}, notes)


def _agreeing(swatches: list[Swatch], cells: list[Cells]) -> tuple[list[Swatch], list[Swatch]]:
    """Patches of like hue, and the odd ones among three or more; of two nobody knows which is wrong."""
    if len(swatches) < 3:
        return swatches, []
    hues = np.array([_hues(cells[s.frame][s.core])[0] for s in swatches])
    near = np.abs(hue_from(hues[:, None], hues[None, :])) <= _SAME_HUE
    kept = near[int(np.argmax(near.sum(1)))]
    if 2 * np.count_nonzero(kept) <= len(swatches):
        return swatches, []
    return [s for s, keep in zip(swatches, kept, strict=True) if keep], [s for s, keep in zip(swatches, kept, strict=True) if not keep]


def _covered(swatches: Sequence[Swatch], number: int, shape: tuple[int, ...]) -> Mask:
    """Patches of one picture with their rims."""
    mask = np.zeros(shape, np.uint8)
    for swatch in swatches:
        if swatch.frame == number:
            rim = max(_RIM, round(_RIM_SHARE * np.count_nonzero(swatch.whole) ** 0.5))
            mask = np.maximum(mask, cv2.dilate(swatch.whole.astype(np.uint8), np.ones((2 * rim + 1, 2 * rim + 1), np.uint8)))
    return mask.astype(bool)


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
        ranges[color] = _range(own, hues[color], near, foreign)
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


def _range(own: Samples, hues: tuple[float, float, float], near: Sequence[tuple[float, float, float]], foreign: Cells) -> ColorRange:
    centre, low, high = hues
    low, high = low - _margin(hues, near, -1), high + _margin(hues, near, 1)
    _, saturation, value = own.paint.hsv()
    hue, foreign_saturation, foreign_value = foreign.hsv()
    off = hue_from(hue, centre)
    # The less chroma the more its noise turns the hue.
    turn = np.minimum(_CHROMA_NOISE / np.maximum(foreign.chroma, 1.0), 1.0) * _HUE_RADIAN
    alike = (off >= low - turn) & (off <= high + turn)
    stray = _STRAY_CELLS * len(own.frames)
    palest, richest = (float(np.quantile(saturation, share)) for share in (_PALE, 1.0 - _TAIL))
    darkest = float(np.quantile(value, _TAIL))
    saturation_low, value_low = _floors(palest, darkest, foreign_saturation[alike], foreign_value[alike], stray)
    alike &= (foreign_saturation >= saturation_low) & (foreign_value >= value_low)
    saturation_high = _ceiling(richest, foreign_saturation[alike], stray)
    return ColorRange(
        hsv_low=(round(centre + low) % 180, round(saturation_low), round(value_low)),
        hsv_high=(round(centre + high) % 180, round(saturation_high), 255),
    )


def _margin(hues: tuple[float, float, float], near: Sequence[tuple[float, float, float]], side: int) -> float:
    """How far the hues may reach beyond what was seen, on one side."""
    centre, low, high = hues
    edge = high if side > 0 else -low
    margin = _HUE_MARGIN
    for other, other_low, other_high in near:
        apart = side * hue_apart(other, centre)
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
    if inside[0, 0] <= stray:
        return float(saturations[0]), float(values[0])
    good = inside <= max(stray, least + _SPARE * (inside[0, 0] - least))
    effort = np.add.outer(np.arange(_STEPS), np.arange(_STEPS)).astype(np.float64)
    i, j = divmod(int(np.argmin(np.where(good, effort, np.inf))), _STEPS)
    # A step more, as the next picture's noise is another.
    return float(saturations[min(i + 1, _STEPS - 1)]), float(values[j])


def _ceiling(richest: float, saturation: Array, stray: float) -> float:
    """An upper bound of saturation: none, unless most of what is foreign (n,) is more saturated than the paint and clear of it."""
    above = saturation[saturation > richest]
    if above.size <= stray or above.size < (1.0 - _USELESS) * saturation.size:
        return 255.0
    return (float(np.sort(above)[int(stray)]) + richest) / 2.0
