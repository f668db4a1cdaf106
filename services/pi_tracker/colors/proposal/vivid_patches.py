"""Patches of saturated colour in pictures, and whether they move from picture to picture. Pure.

What is as large as furniture, as dull as the wall or the colour of skin is passed over.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from services.pi_tracker.colors.pointer import MIN_CELLS
from services.pi_tracker.colors.proposal.moved_cells import Plane, moved_shares
from services.pi_tracker.colors.proposal.paint_names import vivid_mask
from services.pi_tracker.image.chroma import Cells, Mask, skin_mask
from services.pi_tracker.image.hue import Array, hue_difference, mean_hue

# Hues are examined in slices of twice this half width, which overlap, so that touching markers of
# different paint come apart.
_SLICE_STEP, _SLICE_HALF_WIDTH = 10, 10.0
# Where one paint alone is looked for, hues may be so far from its own, and cells are smoothed so
# far (Gaussian, cells): what is pale and small is cut into pieces by noise. Of 16, 20 and 24, and
# of 0, .8 and 1.2, what found most on tuning rooms (testing/families/rooms.py).
_PAINT_HALF_WIDTH, _SMOOTH_CELLS = 20.0, 0.8
# Share of the picture a marker covers at most: a hand's palm in paint at 20 cm; and of its bounding
# box at least.
_MAX_SHARE, _MIN_FILL = 0.02, 0.35
# A thing of the same hue has so many times the cells of a marker before it. Set by hand.
_THING_RATIO = 6
# Skin in shade and between fingers: hues about this, within that, less saturated than orange paint
# is.
_SKIN_HUE, _SKIN_HALF_WIDTH, _SKIN_MAX_SATURATION = 10.0, 14.0, 185.0

Box = tuple[int, int, int, int]


@dataclass(frozen=True)
class Patch:
    """Cells of like hue in a picture, by number; box is x, y, width, height in px.

    moved: the share of the other pictures that have something else there.
    """

    frame: int
    hue: float
    cells: int
    chroma: float
    box: Box
    moved: float

    @property
    def salience(self) -> float:
        """How much it stands out.

        By chroma, as paint does: what is dark is saturated by noise only.
        """
        return self.chroma * self.cells**0.5

    @property
    def moves(self) -> bool:
        """Whether it is elsewhere in most other pictures."""
        return self.moved > 0.5


@dataclass(frozen=True, eq=False)
class View:
    """A picture's cells, all (h, w): colours, which are saturated, and the share of the other
    pictures that have something else there.
    """

    hue: Array
    saturation: Array
    chroma: Array
    vivid: Mask
    moved: Plane


def views_of(pictures: Sequence[Cells], *, smooth: bool = False) -> list[View]:
    """What patches are looked for in; smooth: for paint that is pale and small."""
    found = []
    for cells, moved in zip(pictures, moved_shares(pictures), strict=True):
        seen = _smooth(cells) if smooth else cells
        hue, saturation, value = seen.hsv()
        vivid = vivid_mask(saturation, value) & ~skin_mask(seen)
        found.append(View(hue, saturation, seen.chroma, vivid, moved))
    return found


def patches_in(views: Sequence[View]) -> list[Patch]:
    """All patches of several pictures, of any hue."""
    found = []
    for number, view in enumerate(views):
        for low in range(0, 180, _SLICE_STEP):
            centre = low + 0.5 * _SLICE_STEP
            found += [
                patch
                for patch in _patches(view, number, centre, _SLICE_HALF_WIDTH)
                # Slices overlap: a patch belongs to the one whose centre is nearest.
                if abs(hue_difference(patch.hue, centre)) <= 0.5 * _SLICE_STEP
            ]
    return found


def patches_about(views: Sequence[View], hue: float) -> list[Patch]:
    """Patches that may be of the paint of that hue."""
    return [
        patch
        for number, view in enumerate(views)
        for patch in _patches(view, number, hue, _PAINT_HALF_WIDTH)
    ]


def _patches(view: View, number: int, centre: float, half_width: float) -> list[Patch]:
    """Of hues about a centre, in the picture of that number."""
    mask = np.zeros(view.vivid.shape, bool)
    mask[view.vivid] = np.abs(hue_difference(view.hue[view.vivid], centre)) <= half_width
    all_cells, moved_cells = _Regions.of(mask), _Regions.of(mask & (view.moved > 0.5))
    found = [_patch(view, number, *place) for place in all_cells.places()]
    for window, inside in moved_cells.places():
        behind = int(all_cells.labels[window][inside][0])
        # What moves before a thing of its hue; less of it is a marker's rim that moved a little.
        if all_cells.stats[behind, cv2.CC_STAT_AREA] >= _THING_RATIO * np.count_nonzero(inside):
            found.append(_patch(view, number, window, inside))
    return [patch for patch in found if patch is not None]


class _Regions(NamedTuple):
    """Connected cells: labels (h, w), and OpenCV's statistics of each."""

    labels: npt.NDArray[np.int32]
    stats: npt.NDArray[np.int32]

    @classmethod
    def of(cls, mask: Mask) -> _Regions:
        """Those of a mask, without what is one cell wide."""
        opened = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
        _, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
        return cls(np.asarray(labels), np.asarray(stats))

    def places(self) -> Iterator[tuple[tuple[slice, slice], Mask]]:
        """Window in the picture, and cells in it, of each that may be a marker by its form."""
        for label in range(1, len(self.stats)):
            x, y, w, h, count = (int(entry) for entry in self.stats[label])
            too_small = count < 2 * MIN_CELLS or count < _MIN_FILL * w * h
            if not too_small and count <= _MAX_SHARE * self.labels.size:
                window = np.s_[y : y + h, x : x + w]
                yield window, self.labels[window] == label


def _patch(view: View, number: int, window: tuple[slice, slice], inside: Mask) -> Patch | None:
    """None if it is skin."""
    chroma = view.chroma[window][inside]
    middle = mean_hue(view.hue[window][inside], chroma)
    if _is_skin(middle, float(np.median(view.saturation[window][inside]))):
        return None
    rows, columns = window
    height, width = inside.shape
    return Patch(
        frame=number,
        hue=middle,
        cells=int(np.count_nonzero(inside)),
        chroma=float(np.median(chroma)),
        box=(2 * columns.start, 2 * rows.start, 2 * width, 2 * height),
        moved=float(np.median(view.moved[window][inside])),
    )


def _smooth(cells: Cells) -> Cells:
    y, u, v = (
        np.asarray(cv2.GaussianBlur(plane, (0, 0), _SMOOTH_CELLS))
        for plane in (cells.y, cells.u, cells.v)
    )
    return Cells(y, u, v)


def _is_skin(hue: float, saturation: float) -> bool:
    """Whether a patch is more likely flushed or shaded skin than paint."""
    near_skin = abs(hue_difference(hue, _SKIN_HUE)) <= _SKIN_HALF_WIDTH
    return near_skin and saturation < _SKIN_MAX_SATURATION
