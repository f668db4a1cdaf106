"""HSV ranges of paints from patches that a person pointed at, against skin, background and others.

Pure. Only pictures in which a colour was pointed at say what is not that colour: elsewhere its
marker may be in view, too. Each picture counts as much as another, however large its patch is: the
light of one near marker must not outvote that of all others. A paint that cannot be told apart
still gets a range, and the report (report.py) says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange
from services.pi_tracker.colors.bounds import bounds, hues_of
from services.pi_tracker.colors.paint_patch import PaintPatch, find_patch
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.image.chroma import Cells, Mask, cells_of, concatenate, skin_mask
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.hue import hue_difference

# One paint's hue varies no more than this between pictures; the next paint of a set of six is 20
# away.
_SAME_HUE = 12.0
# Rim of a patch, in cells and as share of its size, that is neither paint nor background: blur, and
# the light that paint throws on skin.
_RIM_CELLS, _RIM_SHARE = 3, 0.2


@dataclass(frozen=True, eq=False)
class Samples:
    """What one colour is, and what it is not, in the pictures in which it was pointed at.

    paint holds as many cells of each picture: of large patches every so many, of small ones all,
    repeatedly.
    """

    color: str
    patches: tuple[PaintPatch, ...]
    paint: Cells  # (n,)
    skin: Cells  # (m,)
    room: Cells  # (k,)

    @property
    def frames(self) -> list[int]:
        """The pictures, by number."""
        return sorted({patch.frame for patch in self.patches})


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Pictures with their names, the patches in them, and notes on pointers that were left out.

    pointed are the pictures, by number, in which somebody pointed at each colour.
    """

    names: list[str]
    pointed: dict[str, set[int]]
    cells: list[Cells]  # (h, w) each
    covered: list[Mask]  # (h, w) each: patches with their rims
    samples: dict[str, Samples]
    notes: list[str]


def gather(
    frames: Sequence[Frame], pointers: Sequence[Pointer], names: Sequence[str] = ()
) -> TrainingSet:
    """The samples of every colour.

    A pointer that shows nothing, or another colour than the rest, is noted and left out. frames are
    in the order of Pointer.frame, and so are their names ("picture 1", ... if none are given).
    Raises CalibrationError if a colour has no pointer that shows it.
    """
    if not pointers:
        raise CalibrationError(
            "nothing is pointed at; click on a marker in the picture, "
            "or give --box COLOR=x,y,width,height"
        )
    pictures = list(names) or [f"picture {number + 1}" for number in range(len(frames))]
    cells = [cells_of(frame) for frame in frames]
    patches, notes = _found_patches(cells, pointers, pictures)
    for color, found in patches.items():
        patches[color], outliers = _without_outliers(found, cells)
        notes += [
            f"{color} in {pictures[patch.frame]}: has another hue than in the others "
            "(left out: was something else pointed at?)"
            for patch in outliers
        ]
    all_patches = [patch for found in patches.values() for patch in found]
    covered = [_covered(all_patches, number, part.shape) for number, part in enumerate(cells)]
    samples = {color: _samples(color, found, cells, covered) for color, found in patches.items()}
    pointed: dict[str, set[int]] = {}
    for pointer in pointers:
        pointed.setdefault(pointer.color, set()).add(pointer.frame)
    return TrainingSet(pictures, pointed, cells, covered, samples, notes)


def _found_patches(
    cells: list[Cells], pointers: Sequence[Pointer], names: Sequence[str]
) -> tuple[dict[str, list[PaintPatch]], list[str]]:
    """The patches of every colour, and notes on pointers without one."""
    patches: dict[str, list[PaintPatch]] = {pointer.color: [] for pointer in pointers}
    failures: dict[str, list[str]] = {}
    for pointer in pointers:
        if not 0 <= pointer.frame < len(cells):
            raise CalibrationError(
                f"{pointer}: there is no picture {pointer.frame}; there are {len(cells)}"
            )
        try:
            patches[pointer.color].append(find_patch(cells[pointer.frame], pointer))
        except CalibrationError as error:
            text = f"{names[pointer.frame]}, {error}"
            failures.setdefault(pointer.color, []).append(text)
    for color, found in patches.items():
        if not found:
            raise CalibrationError(failures[color][0])
    notes = [
        f"{text} (left out: the colour was found in other pictures)"
        for texts in failures.values()
        for text in texts
    ]
    return patches, notes


def _without_outliers(
    patches: list[PaintPatch], cells: list[Cells]
) -> tuple[list[PaintPatch], list[PaintPatch]]:
    """Patches of like hue, and the outliers among three or more.

    Of two it is unknown which is wrong.
    """
    if len(patches) < 3:
        return patches, []
    hues = np.array([hues_of(cells[patch.frame][patch.core]).middle for patch in patches])
    near = np.abs(hue_difference(hues[:, None], hues[None, :])) <= _SAME_HUE  # (n, n)
    kept = near[int(np.argmax(near.sum(1)))]
    if 2 * np.count_nonzero(kept) <= len(patches):
        return patches, []
    return (
        [patch for patch, keep in zip(patches, kept, strict=True) if keep],
        [patch for patch, keep in zip(patches, kept, strict=True) if not keep],
    )


def _covered(patches: Sequence[PaintPatch], number: int, shape: tuple[int, ...]) -> Mask:
    """Patches of one picture with their rims, (h, w)."""
    mask = np.zeros(shape, np.uint8)
    for patch in patches:
        if patch.frame == number:
            rim = max(_RIM_CELLS, round(_RIM_SHARE * np.count_nonzero(patch.whole) ** 0.5))
            element = np.ones((2 * rim + 1, 2 * rim + 1), np.uint8)
            mask = np.maximum(mask, cv2.dilate(patch.whole.astype(np.uint8), element))
    return mask.astype(bool)


def _samples(
    color: str, patches: list[PaintPatch], cells: list[Cells], covered: list[Mask]
) -> Samples:
    numbers = sorted({patch.frame for patch in patches})
    paint = _balanced(
        [
            concatenate([cells[n][patch.core] for patch in patches if patch.frame == n])
            for n in numbers
        ]
    )
    rest = concatenate([cells[number][~covered[number]] for number in numbers])
    skin = skin_mask(rest)
    return Samples(color, tuple(patches), paint, rest[skin], rest[~skin])


def _balanced(pictures: list[Cells]) -> Cells:
    """Cells (n,) of several pictures (k,), as many of each; about as many as there are in all."""
    share = max(1, round(sum(part.y.size for part in pictures) / len(pictures)))
    return concatenate(
        [part[np.arange(share) * part.y.size // share] for part in pictures if part.y.size]
    )


def fit(samples: Mapping[str, Samples]) -> dict[str, ColorRange]:
    """A range for every colour."""
    hues = {color: hues_of(own.paint) for color, own in samples.items()}
    ranges = {}
    for color, own in samples.items():
        others = [other for name, other in samples.items() if name != color]
        foreign = concatenate([own.skin, own.room, *(other.paint for other in others)])
        neighbours = [hues[other.color] for other in others]
        ranges[color] = bounds(own.paint, hues[color], neighbours, foreign, len(own.frames))
    return ranges
