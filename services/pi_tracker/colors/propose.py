"""Markers that nobody pointed at: patches of saturated colour in the pictures, grouped by hue,
named, and proposed as boxes. Pure.

What is as large as furniture, as dull as the wall or the colour of skin is passed over; whatever
else of that kind stands in the room is proposed as well, so a person looks at the proposal. From
skin and room it also follows which further paints would stand out best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from services.pi_tracker.colors.paint_patch import MIN_CELLS, Pointer
from services.pi_tracker.image.chroma import (
    Cells,
    cells_of,
    hue_apart,
    hue_from,
    looks_like_skin,
    mean_hue,
)
from services.pi_tracker.image.frame import Frame

# Middle hues of acrylic paints by the names people give them, OpenCV 0..180: of colour charts, and
# of the simulator's paints.
PAINT_HUES: dict[str, float] = {
    "red": 0.0,
    "orange": 11.0,
    "yellow": 25.0,
    "lime": 39.0,
    "green": 66.0,
    "cyan": 92.0,
    "blue": 112.0,
    "violet": 134.0,
    "magenta": 161.0,
}
# A name is not given to a hue further from it than this.
_NAME_REACH = 16.0
# Patches of one marker in several pictures differ less, markers of different paint more.
_SAME_HUE = 7.0
# A marker's patch is at least this saturated and this bright, and stands out from the cells around
# it.
_LEAST_SATURATION, _LEAST_VALUE = 55.0, 35.0
# Share of the picture a marker covers at most: a hand's palm in paint at 20 cm; and of its bounding
# box at least.
_LARGEST, _FILL = 0.02, 0.35
# Skin in shade and between fingers: hues about this, within that, less saturated than orange paint
# is.
_SKIN = (10.0, 14.0, 185.0)
# A marker stands out at least so much against the one that stands out most: the simulator's a
# quarter, its dark corners a tenth; the gaps between the fingers that hold a pastel ball a ninth.
_LEAST_SHARE = 0.2
# Hues nearer than this to another paint, to skin or to much of the room are not suggested.
_CLEAR = 12.0
# Share of a picture's cells a hue must cover to count as the room's.
_ROOM_SHARE = 0.003


@dataclass(frozen=True)
class Proposal:
    """A patch seen in `pictures` pictures, named after its hue.

    Boxes are pointers to it, ready to be fitted.
    """

    color: str
    hue: float
    pictures: int
    boxes: tuple[Pointer, ...]


@dataclass(frozen=True)
class Suggestion:
    """A paint that is not in the pictures yet, and how many hues it keeps from skin, room and the
    proposals.
    """

    color: str
    clearance: float


@dataclass(frozen=True)
class _Patch:
    frame: int
    hue: float
    cells: int
    chroma: float
    box: tuple[int, int, int, int]  # px


def propose(
    frames: Sequence[Frame], wanted: Sequence[str] = ()
) -> tuple[list[Proposal], list[Suggestion]]:
    """Markers by what the pictures show, strongest first, and further paints, clearest first.

    wanted are the colours of rig.toml: patches get their names where the hues fit.
    """
    cells = [cells_of(frame) for frame in frames]
    patches = [patch for number, part in enumerate(cells) for patch in _patches(part, number)]
    # Seen in at least half of the pictures: a reflection or a passing thing is not.
    groups = [
        group
        for group in _grouped(patches)
        if 2 * len({patch.frame for patch in group}) >= len(frames)
    ]
    largest = max(map(_standing_out, groups), default=0.0)
    groups = [
        group
        for group in sorted(groups, key=_standing_out, reverse=True)
        if _standing_out(group) >= _LEAST_SHARE * largest
    ]
    groups = [
        group
        for number, group in enumerate(groups)
        if not any(_same_thing(group, other) for other in groups[:number])
    ]
    proposals, taken = [], set[str]()
    for group in groups:
        hue = mean_hue(
            np.array([patch.hue for patch in group]),
            np.array([float(patch.cells) for patch in group]),
        )
        name = _name(hue, wanted, taken)
        taken.add(name)
        boxes = tuple(
            Pointer(name, patch.frame, *patch.box)
            for patch in sorted(group, key=lambda patch: patch.frame)
        )
        proposals.append(Proposal(name, round(hue, 1), len(boxes), boxes))
    return proposals, suggest(cells, [proposal.hue for proposal in proposals])


def _patches(cells: Cells, number: int) -> list[_Patch]:
    hue, saturation, value = cells.hsv()
    vivid = (saturation >= _LEAST_SATURATION) & (value >= _LEAST_VALUE) & ~looks_like_skin(cells)
    found = []
    size = cells.y.size
    for low in range(0, 180, 10):
        # Overlapping slices of hue, so that touching markers of different paint come apart; doubles
        # are merged below.
        mask = vivid & (np.abs(hue_from(hue, low + 5.0)) <= 10.0)
        opened = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
        _, labels, stats, _ = cv2.connectedComponentsWithStats(opened, connectivity=4)
        for label in range(1, len(stats)):
            x, y, w, h, count = (int(number) for number in stats[label])
            if count < 2 * MIN_CELLS or count > _LARGEST * size or count < _FILL * w * h:
                continue
            own = labels[y : y + h, x : x + w] == label
            part = cells[y : y + h, x : x + w][own]
            middle = mean_hue(part.hsv()[0], part.chroma)
            if _skinny(middle, float(np.median(part.hsv()[1]))):
                continue
            if abs(hue_apart(middle, low + 5.0)) <= 5.0:
                found.append(
                    _Patch(
                        number,
                        middle,
                        count,
                        float(np.median(part.chroma)),
                        (2 * x, 2 * y, 2 * w, 2 * h),
                    )
                )
    return found


def _skinny(hue: float, saturation: float) -> bool:
    """Whether a patch is more likely flushed or shaded skin than paint."""
    return abs(hue_apart(hue, _SKIN[0])) <= _SKIN[1] and saturation < _SKIN[2]


def _weight(patch: _Patch) -> float:
    """How much a patch stands out: paint by its chroma, while what is dark is saturated by noise
    only.
    """
    return patch.chroma * patch.cells**0.5


def _grouped(patches: list[_Patch]) -> list[list[_Patch]]:
    """Patches of like hue, one per picture, those that stand out most first."""
    groups: list[list[_Patch]] = []
    for patch in sorted(patches, key=_weight, reverse=True):
        near = next(
            (group for group in groups if abs(hue_apart(patch.hue, group[0].hue)) <= _SAME_HUE),
            None,
        )
        if near is None:
            groups.append([patch])
        elif all(other.frame != patch.frame for other in near):
            near.append(patch)
    return groups


def _standing_out(group: list[_Patch]) -> float:
    return float(np.median([_weight(patch) for patch in group]))


def _same_thing(group: list[_Patch], stronger: list[_Patch]) -> bool:
    """Whether one thing's light and dark sides were taken for two: their boxes overlap in most
    pictures.
    """
    there = {patch.frame: patch.box for patch in stronger}
    here = {patch.frame: patch.box for patch in group}
    return 2 * sum(
        _overlap(box, there[frame]) for frame, box in here.items() if frame in there
    ) > len(here)


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> bool:
    """Whether half of the smaller box lies in the other; touching fingers' boxes overlap less."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return min(width, height) > 0 and 2 * width * height > min(a[2] * a[3], b[2] * b[3])


def _name(hue: float, wanted: Sequence[str], taken: set[str]) -> str:
    """The nearest name, of rig.toml's colours first.

    A hue no name is near to, or a name twice, gets its number.
    """
    for names in (wanted, PAINT_HUES):
        known = [name for name in names if name in PAINT_HUES and name not in taken]
        near = min(known, key=lambda name: abs(hue_apart(hue, PAINT_HUES[name])), default=None)
        if near is not None and abs(hue_apart(hue, PAINT_HUES[near])) <= _NAME_REACH:
            return near
    return f"hue{round(hue) % 180}"


def suggest(cells: Sequence[Cells], used: Sequence[float]) -> list[Suggestion]:
    """Paints whose hue is clear of skin, of much of the room and of the hues in use.

    Clearest first.
    """
    avoid = [*used, *_room_hues(cells)]
    found = []
    for name, hue in PAINT_HUES.items():
        clearance = min((abs(hue_apart(hue, other)) for other in avoid), default=90.0)
        if clearance >= _CLEAR:
            found.append(Suggestion(name, round(clearance, 1)))
    return sorted(found, key=lambda suggestion: -suggestion.clearance)


def _room_hues(cells: Sequence[Cells]) -> list[float]:
    """Hues that skin has, always and in these pictures, and those of which the room holds much."""
    # Skin of any complexion in white light has OpenCV hues of 3 to 20.
    hues = [4.0, 12.0, 19.0]
    total = np.zeros(36)
    for part in cells:
        hue, saturation, value = part.hsv()
        vivid = (saturation >= _LEAST_SATURATION) & (value >= _LEAST_VALUE)
        total += np.bincount((hue[vivid] // 5).astype(np.int64) % 36, minlength=36) / part.y.size
    return hues + [
        5.0 * bin_ + 2.5
        for bin_ in np.nonzero(total / max(len(cells), 1) >= _ROOM_SHARE)[0].tolist()
    ]


def boxes_of(proposals: Sequence[Proposal]) -> list[Pointer]:
    """All pointers of several proposals."""
    return [box for proposal in proposals for box in proposal.boxes]
