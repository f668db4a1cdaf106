"""Where the middle of a marker is that the picture's edge cuts, from what is left of it. Pure.

Of a marker that is half outside the centre of the rest is four tenths of a radius inside: to the
other camera, which sees it whole, that is centimetres of depth. How far the marker reached when all
of it was seen tells how far its middle is beyond the centre of the rest.

The whole counts as an ellipse: across the edge it is as a disc, whose part within a line u radii
from its middle has part_of(u) of its area, and its centre short_by(u) radii before that middle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from statistics import median
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.measure.centroid import CUT_QUALITY, CUT_SIGMA, Centroid

# A marker whose middle is farther outside than this, in radii, shows too little to be measured.
_FARTHEST = -0.8
_LINES = np.linspace(_FARTHEST, 1.0, 181)
# How far a marker reaches is remembered for so long: hands turn. Then others' size is as good.
_REMEMBERED_NS = 1_000_000_000
# How unsure it is, as a share of itself: as remembered, and as others have it. (Pictures of six of
# the tuning families, cut at 72 lines: .1 and .14 RMS, with tails.)
_REMEMBERED_SIGMA, _OTHERS_SIGMA = 0.12, 0.2
# The same of one that is taken for a disc, by the area of what is left: where no marker is whole.
_DISC_SIGMA = 0.3


def part_of(line: Array) -> Array:
    """The share of a disc's area that is within a line so many radii beyond its middle, -1..1."""
    return 0.5 + (line * np.sqrt(1.0 - line**2) + np.arcsin(line)) / np.pi


def short_by(line: Array) -> Array:
    """How far the centre of that part is before the disc's middle, radii."""
    return 2.0 / (3.0 * np.pi) * (1.0 - line**2) ** 1.5 / part_of(line)


# By line: the part, how far its centre is short, and how far that is from the line. The square of
# the last over the part falls with what is missing, whatever the disc's size.
_PARTS, _SHORT = part_of(_LINES), short_by(_LINES)
_TO_LINE = _LINES + _SHORT
_SQUARES = _TO_LINE**2 / _PARTS


# An edge: across x (0) or y (1), and whether it is at the end (1) or at the beginning (-1) of that.
_Side = tuple[int, float]


class _Whole(NamedTuple):
    """A marker of which all was seen."""

    blob: Blob
    area_px2: float
    stamp_ns: int

    def reach_px(self, axis: int) -> float:
        """How far it reaches from its middle along x (0) or y (1): an ellipse of its moments."""
        cells = np.nonzero(self.blob.mask)[::-1]
        # Cells are two pixels wide, which spread by 4 / 12 themselves.
        along, across = (4.0 * float(cells[of].var()) + 1.0 / 3.0 for of in (axis, 1 - axis))
        # 2 sqrt(along), were the mask's area the one that was measured.
        return math.sqrt(self.area_px2 / math.pi * math.sqrt(along / across))


class CutMarkers:
    """Measurements of one camera's markers, those restored that the picture's edge cuts."""

    def __init__(self) -> None:
        # By colour.
        self._wholes: dict[int, _Whole] = {}

    def restored(
        self, measured: Mapping[int, tuple[Blob, Centroid]], size: tuple[int, int], stamp_ns: int
    ) -> list[Centroid]:
        """Centroids in their order; size: of the picture, in cells.

        A marker that a corner cuts, or that is larger than it can be, stays as it is measured: its
        sigma says that it may be anywhere near.
        """
        cut: dict[int, list[_Side]] = {}
        for color, (blob, centroid) in measured.items():
            if sides := _cut_sides(blob, size):
                cut[color] = sides
            else:
                self._wholes[color] = _Whole(blob, centroid.area_px, stamp_ns)
        return [
            self._of_whole(color, one, cut[color][0], size, stamp_ns)
            if color in cut and len(cut[color]) == 1
            else one
            for color, (_, one) in measured.items()
        ]

    def _of_whole(
        self, color: int, part: Centroid, side: _Side, size: tuple[int, int], stamp_ns: int
    ) -> Centroid:
        """What is measured of the part of a colour's marker that a side leaves, as of the whole.

        What reaches farther than the marker does, for all that is unsure, is no part of it.
        """
        axis, ahead = side
        edge_px = 2.0 * size[axis] - 0.5 if ahead > 0.0 else -0.5
        to_edge_px = ahead * (edge_px - part[axis])
        reach_px, unsure = self._reach(color, axis, stamp_ns) or _reach_of_disc(part, to_edge_px)
        if not reach_px * _TO_LINE[0] < to_edge_px <= (1.0 + unsure) * reach_px:
            return part
        line = np.interp(to_edge_px / reach_px, _TO_LINE, _LINES)
        share, short_px = float(np.interp(line, _LINES, _PARTS)), _short_px(to_edge_px, reach_px)
        x_px, y_px = part.x_px, part.y_px
        if axis == 0:
            x_px += ahead * short_px
        else:
            y_px += ahead * short_px
        # Half of what two sigmas of reach add: what one adds is next to nothing of a marker that
        # just seems whole, and may be longer.
        farther_px = 0.5 * (_short_px(to_edge_px, (1.0 + 2.0 * unsure) * reach_px) - short_px)
        uncut_px = part.sigma_px - CUT_SIGMA * math.sqrt(part.area_px)
        return Centroid(
            x_px,
            y_px,
            part.area_px / share,
            math.hypot(uncut_px, farther_px),
            part.quality / CUT_QUALITY * share,
        )

    def _reach(self, color: int, axis: int, stamp_ns: int) -> tuple[float, float] | None:
        """How far a colour's marker reaches along an axis, px, and how unsure that is, as a share.

        None if no whole marker tells.
        """
        whole = self._wholes.get(color)
        if whole is not None and 0 <= stamp_ns - whole.stamp_ns <= _REMEMBERED_NS:
            return whole.reach_px(axis), _REMEMBERED_SIGMA
        areas_px2 = [other.area_px2 for other in self._wholes.values()]
        return (math.sqrt(median(areas_px2) / math.pi), _OTHERS_SIGMA) if areas_px2 else None


def _reach_of_disc(part: Centroid, to_edge_px: float) -> tuple[float, float]:
    """As CutMarkers._reach, of a disc of which this part is left."""
    line = np.interp(math.pi * to_edge_px**2 / part.area_px, _SQUARES, _LINES)
    return to_edge_px / float(np.interp(line, _LINES, _TO_LINE)), _DISC_SIGMA


def _cut_sides(blob: Blob, size: tuple[int, int]) -> list[_Side]:
    """The picture's edges that a blob touches."""
    left, top, right, bottom = blob.rect
    sides: list[_Side] = []
    if left <= 0:
        sides.append((0, -1.0))
    if right >= size[0]:
        sides.append((0, 1.0))
    if top <= 0:
        sides.append((1, -1.0))
    if bottom >= size[1]:
        sides.append((1, 1.0))
    return sides


def _short_px(to_edge_px: float, reach_px: float) -> float:
    """How far a part's centre is before its marker's middle."""
    return reach_px * float(np.interp(to_edge_px / reach_px, _TO_LINE, _SHORT))
