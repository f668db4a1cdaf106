"""HSV ranges of paints from patches that a person pointed at, held against skin, background and
each other. Pure.

Only pictures in which a colour was pointed at say what is not that colour: elsewhere its marker may
be in view, too. A paint that cannot be told apart still gets a range, and the report
(color_report.py) says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange
from services.pi_tracker.colors.bounds import bounds, hues_of
from services.pi_tracker.colors.paint_patch import Pointer, Swatch, find_swatch
from services.pi_tracker.image.chroma import (
    Cells,
    Mask,
    cells_of,
    hue_from,
    joined,
    looks_like_skin,
)
from services.pi_tracker.image.frame import Frame

# One paint's hue varies no more than this between pictures; the next paint of a set of six is 20
# away.
_SAME_HUE = 12.0
# Rim of a patch, in cells and as share of its size, that is neither paint nor background: blur, and
# the light that paint throws on skin.
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
    """The samples of every colour; a pointer that shows nothing, or another colour than the rest,
    is noted and left out.

    frames are in the order of Pointer.frame. Raises CalibrationError if a colour has no pointer
    that shows it.
    """
    if not pointers:
        raise CalibrationError(
            "nothing is pointed at; click on a marker in the picture, or give --box COLOR=x,y,width,height"
        )
    cells = [cells_of(frame) for frame in frames]
    swatches: dict[str, list[Swatch]] = {pointer.color: [] for pointer in pointers}
    failures: dict[str, list[str]] = {}
    for pointer in pointers:
        if not 0 <= pointer.frame < len(frames):
            raise CalibrationError(
                f"{pointer}: there is no picture {pointer.frame}; there are {len(frames)}"
            )
        try:
            swatches[pointer.color].append(find_swatch(cells[pointer.frame], pointer))
        except CalibrationError as error:
            failures.setdefault(pointer.color, []).append(str(error))
    for color, found in swatches.items():
        if not found:
            raise CalibrationError(failures[color][0])
    notes = [
        f"{text} (left out: the colour was found in other pictures)"
        for texts in failures.values()
        for text in texts
    ]
    for color, found in swatches.items():
        swatches[color], odd = _agreeing(found, cells)
        notes += [
            f"{color} in picture {s.frame}: has another hue than in the others (left out: was something else pointed at?)"
            for s in odd
        ]
    covered = [
        _covered([s for found in swatches.values() for s in found], number, part.shape)
        for number, part in enumerate(cells)
    ]
    return Study(
        cells,
        covered,
        {color: _samples(color, found, cells, covered) for color, found in swatches.items()},
        notes,
    )


def _agreeing(swatches: list[Swatch], cells: list[Cells]) -> tuple[list[Swatch], list[Swatch]]:
    """Patches of like hue, and the odd ones among three or more.

    Of two nobody knows which is wrong.
    """
    if len(swatches) < 3:
        return swatches, []
    hues = np.array([hues_of(cells[s.frame][s.core]).middle for s in swatches])
    near = np.abs(hue_from(hues[:, None], hues[None, :])) <= _SAME_HUE
    kept = near[int(np.argmax(near.sum(1)))]
    if 2 * np.count_nonzero(kept) <= len(swatches):
        return swatches, []
    return [s for s, keep in zip(swatches, kept, strict=True) if keep], [
        s for s, keep in zip(swatches, kept, strict=True) if not keep
    ]


def _covered(swatches: Sequence[Swatch], number: int, shape: tuple[int, ...]) -> Mask:
    """Patches of one picture with their rims."""
    mask = np.zeros(shape, np.uint8)
    for swatch in swatches:
        if swatch.frame == number:
            rim = max(_RIM, round(_RIM_SHARE * np.count_nonzero(swatch.whole) ** 0.5))
            mask = np.maximum(
                mask,
                cv2.dilate(
                    swatch.whole.astype(np.uint8), np.ones((2 * rim + 1, 2 * rim + 1), np.uint8)
                ),
            )
    return mask.astype(bool)


def _samples(
    color: str, swatches: list[Swatch], cells: list[Cells], covered: list[Mask]
) -> Samples:
    numbers = sorted({swatch.frame for swatch in swatches})
    rest = joined([cells[number][~covered[number]] for number in numbers])
    skin = looks_like_skin(rest)
    return Samples(
        color,
        tuple(swatches),
        joined([cells[s.frame][s.core] for s in swatches]),
        rest[skin],
        rest[~skin],
    )


def fit(samples: Mapping[str, Samples]) -> dict[str, ColorRange]:
    """A range for every colour."""
    hues = {color: hues_of(own.paint) for color, own in samples.items()}
    ranges = {}
    for color, own in samples.items():
        foreign = joined(
            [own.skin, own.room, *(other.paint for name, other in samples.items() if name != color)]
        )
        near = [hues[name] for name in samples if name != color]
        ranges[color] = bounds(own.paint, hues[color], near, foreign, len(own.frames))
    return ranges
