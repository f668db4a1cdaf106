"""Markers that nobody pointed at: patches of saturated colour, proposed as boxes to fit.

Patches are grouped by hue and named. Pure. What is as large as furniture, as dull as the wall or
the colour of skin is passed over. Whatever else of that kind is in the room is proposed as well, so
a person looks at the proposal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from services.pi_tracker.colors.paint_names import Suggestion, paint_name, suggest, vivid_mask
from services.pi_tracker.colors.pointer import MIN_CELLS, Pointer
from services.pi_tracker.image.chroma import Cells, cells_of, skin_mask
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.hue import hue_difference, mean_hue

# Patches of one marker in several pictures differ less in hue, markers of different paint more.
_SAME_HUE = 7.0
# Hues are examined in slices of twice this half width, which overlap, so that touching markers of
# different paint come apart.
_SLICE_STEP, _SLICE_HALF_WIDTH = 10, 10.0
# Share of the picture a marker covers at most: a hand's palm in paint at 20 cm; and of its bounding
# box at least.
_MAX_SHARE, _MIN_FILL = 0.02, 0.35
# Skin in shade and between fingers: hues about this, within that, less saturated than orange paint
# is.
_SKIN_HUE, _SKIN_HALF_WIDTH, _SKIN_MAX_SATURATION = 10.0, 14.0, 185.0
# A marker's salience is at least this share of the most salient one's: the simulator's a quarter,
# its dark corners a tenth; the gaps between the fingers that hold a pastel ball a ninth.
_MIN_SALIENCE_SHARE = 0.2


@dataclass(frozen=True)
class Proposal:
    """A patch seen in `pictures` pictures, named after its hue.

    boxes are pointers to it, ready to be fitted.
    """

    color: str
    hue: float
    pictures: int
    boxes: tuple[Pointer, ...]


@dataclass(frozen=True)
class _Patch:
    frame: int
    hue: float
    cells: int
    chroma: float
    box: tuple[int, int, int, int]  # x, y, width, height; px

    @property
    def salience(self) -> float:
        """How much it stands out.

        By chroma, as paint does: what is dark is saturated by noise only.
        """
        return self.chroma * self.cells**0.5


def propose(
    frames: Sequence[Frame], preferred_names: Sequence[str] = ()
) -> tuple[list[Proposal], list[Suggestion]]:
    """Markers by what the pictures show, most salient first, and further paints, clearest first.

    preferred_names are the colours of rig.toml: patches get their names where the hues fit.
    """
    cells = [cells_of(frame) for frame in frames]
    patches = [patch for number, part in enumerate(cells) for patch in _patches(part, number)]
    proposals, taken = [], set[str]()
    for group in _salient_groups(patches, len(frames)):
        hue = mean_hue(
            np.array([patch.hue for patch in group]),
            np.array([float(patch.cells) for patch in group]),
        )
        name = paint_name(hue, preferred_names, taken)
        taken.add(name)
        boxes = tuple(
            Pointer(name, patch.frame, *patch.box)
            for patch in sorted(group, key=lambda patch: patch.frame)
        )
        proposals.append(Proposal(name, round(hue, 1), len(boxes), boxes))
    return proposals, suggest(cells, [proposal.hue for proposal in proposals])


def _patches(cells: Cells, number: int) -> list[_Patch]:
    """Patches of saturated colour in one picture."""
    hue, saturation, value = cells.hsv()
    vivid = vivid_mask(saturation, value) & ~skin_mask(cells)
    found = []
    for low in range(0, 180, _SLICE_STEP):
        centre = low + _SLICE_STEP / 2.0
        mask = vivid & (np.abs(hue_difference(hue, centre)) <= _SLICE_HALF_WIDTH)
        opened = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
        _, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
        for label in range(1, len(stats)):
            x, y, w, h, count = (int(entry) for entry in stats[label])
            too_small = count < 2 * MIN_CELLS or count < _MIN_FILL * w * h
            if too_small or count > _MAX_SHARE * cells.y.size:
                continue
            inside = labels[y : y + h, x : x + w] == label
            part = cells[y : y + h, x : x + w][inside]
            part_hue, part_saturation, _ = part.hsv()
            middle = mean_hue(part_hue, part.chroma)
            if _is_skin(middle, float(np.median(part_saturation))):
                continue
            # Slices overlap: a patch belongs to the one whose centre is nearest.
            if abs(hue_difference(middle, centre)) <= _SLICE_STEP / 2.0:
                chroma = float(np.median(part.chroma))
                found.append(_Patch(number, middle, count, chroma, (2 * x, 2 * y, 2 * w, 2 * h)))
    return found


def _is_skin(hue: float, saturation: float) -> bool:
    """Whether a patch is more likely flushed or shaded skin than paint."""
    near_skin = abs(hue_difference(hue, _SKIN_HUE)) <= _SKIN_HALF_WIDTH
    return near_skin and saturation < _SKIN_MAX_SATURATION


def _salient_groups(patches: list[_Patch], pictures: int) -> list[list[_Patch]]:
    """Patches of one marker each, most salient first."""
    # Seen in at least half of the pictures: a reflection or a passing thing is not.
    groups = [
        group
        for group in _grouped_by_hue(patches)
        if 2 * len({patch.frame for patch in group}) >= pictures
    ]
    groups = sorted(groups, key=_salience, reverse=True)
    largest = max(map(_salience, groups), default=0.0)
    salient = [group for group in groups if _salience(group) >= _MIN_SALIENCE_SHARE * largest]
    return [
        group
        for number, group in enumerate(salient)
        if not any(_is_same_object(group, other) for other in salient[:number])
    ]


def _grouped_by_hue(patches: list[_Patch]) -> list[list[_Patch]]:
    """Patches of like hue, one per picture, the most salient first."""
    groups: list[list[_Patch]] = []
    for patch in sorted(patches, key=lambda patch: patch.salience, reverse=True):
        near = next((group for group in groups if _is_same_hue(patch, group[0])), None)
        if near is None:
            groups.append([patch])
        elif all(other.frame != patch.frame for other in near):
            near.append(patch)
    return groups


def _is_same_hue(a: _Patch, b: _Patch) -> bool:
    return abs(hue_difference(a.hue, b.hue)) <= _SAME_HUE


def _salience(group: list[_Patch]) -> float:
    return float(np.median([patch.salience for patch in group]))


def _is_same_object(group: list[_Patch], stronger: list[_Patch]) -> bool:
    """Whether one object's light and dark sides were taken for two.

    Then their boxes overlap in most pictures.
    """
    stronger_boxes = {patch.frame: patch.box for patch in stronger}
    own_boxes = {patch.frame: patch.box for patch in group}
    overlapping = sum(
        _overlap(box, stronger_boxes[frame])
        for frame, box in own_boxes.items()
        if frame in stronger_boxes
    )
    return 2 * overlapping > len(own_boxes)


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> bool:
    """Whether half of the smaller box lies in the other; touching fingers' boxes overlap less."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return min(width, height) > 0 and 2 * width * height > min(a[2] * a[3], b[2] * b[3])


def boxes_of(proposals: Sequence[Proposal]) -> list[Pointer]:
    """All pointers of several proposals."""
    return [box for proposal in proposals for box in proposal.boxes]
