"""Markers that nobody pointed at: patches of saturated colour, proposed as boxes to fit.

Patches are grouped by hue and named; what moves comes first, since a hand does and a room does not.
Pure. Whatever else stands out in a room may be proposed as well, so a person looks at the proposal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.colors.proposal.hand_names import (
    LEAST_FIT,
    beside_hand,
    fit_beside,
    of_a_hand,
)
from services.pi_tracker.colors.proposal.paint_names import (
    NAMED_HUES,
    Choose,
    Suggestion,
    paint_names,
    suggest,
    with_most_gain,
)
from services.pi_tracker.colors.proposal.patch_groups import (
    Group,
    clearness,
    has_hue_of,
    hue_of,
    importance,
    median_of,
    overlap,
    salient_groups,
)
from services.pi_tracker.colors.proposal.vivid_patches import (
    Box,
    Patch,
    patches_about,
    patches_in,
    views_of,
)
from services.pi_tracker.identify.hand_layout import NO_LANDMARKS, Landmarks
from services.pi_tracker.image.chroma import Cells, cells_of
from services.pi_tracker.image.frame import Frame

# What stands still is seen in this share of the pictures at least, as a reflection or a passing
# thing is not; a tip that moves is before things of its hue in some.
_STILL_SHARE, _MOVING_SHARE = 0.5, 0.35
# How far about the markers that were found the rest of a hand is, in their spread: a wrist is one
# to two spreads away.
_HAND_REACH = 2.0
# What neither moves nor stands still for sure counts so much. Both set by hand.
_LEAST_CLEAR = 0.1


@dataclass(frozen=True)
class Proposal:
    """A patch seen in `pictures` pictures, named after its hue.

    boxes are pointers to it, ready to be fitted; moves: is it elsewhere from picture to picture?
    """

    color: str
    hue: float
    pictures: int
    boxes: tuple[Pointer, ...]
    moves: bool


def propose(
    frames: Sequence[Frame],
    preferred_names: Sequence[str] = (),
    landmarks: Landmarks = NO_LANDMARKS,
) -> tuple[list[Proposal], list[Suggestion]]:
    """Markers by what the pictures show, and further paints, clearest first.

    Markers: what moves, then what is about it and may be a colour that is missing, then all else,
    each most salient first. preferred_names are the colours of rig.toml: patches get their names
    where the hues fit, and where they are as its landmarks are.
    """
    cells = [cells_of(frame) for frame in frames]
    patches = patches_in(views_of(cells))
    moving = salient_groups([p for p in patches if p.moves], _MOVING_SHARE * len(frames))
    by_name = partial(_named, len(frames), preferred_names)
    named = by_name(moving, {}, surely_paint=True, choose=of_a_hand(moving, landmarks))
    hand = {name: group for name, group in named.items() if name in preferred_names}
    missing = [name for name in preferred_names if name in NAMED_HUES and name not in hand]
    if hand and missing:
        named |= _near(cells, missing, hand, landmarks)
    rest = [p for p in patches if not p.moves and not has_hue_of(p, named.values())]
    still = salient_groups(rest, _STILL_SHARE * len(frames))
    named |= by_name(still, named, choose=beside_hand(still, hand, landmarks))
    proposals = [_proposal(name, group) for name, group in named.items()]
    return proposals, suggest(cells, [proposal.hue for proposal in proposals])


def _named(
    pictures: int,
    preferred: Sequence[str],
    groups: Sequence[Group],
    taken: Mapping[str, Group],
    *,
    surely_paint: bool = False,
    choose: Choose = with_most_gain,
) -> dict[str, Group]:
    """Groups by names that are not taken yet."""
    names = paint_names(
        [hue_of(group) for group in groups],
        preferred,
        set(taken),
        weights=[
            max(median_of(group, clearness), _LEAST_CLEAR) * len(group) / pictures
            for group in groups
        ],
        surely_paint=surely_paint,
        choose=choose,
    )
    return dict(zip(names, groups, strict=True))


def _near(
    cells: Sequence[Cells],
    missing: Sequence[str],
    hand: Mapping[str, Group],
    landmarks: Landmarks,
) -> dict[str, Group]:
    """Of colours that are missing, what may be theirs where the rest of the hand is.

    A wrist hardly moves in some takes.
    """
    markers = list(hand.values())
    views, boxes = views_of(cells, smooth=True), _hand_boxes(markers)
    found: dict[str, Group] = {}
    for name in missing:
        near = [
            patch
            for patch in patches_about(views, NAMED_HUES[name])
            if patch.frame in boxes
            and overlap(patch.box, boxes[patch.frame])
            and not has_hue_of(patch, [*markers, *found.values()])
        ]
        groups = salient_groups(near, _STILL_SHARE * len(cells), markers, _stirring)
        of_hand = [
            (importance(group, _stirring) * fit, group)
            for group in groups
            if (fit := fit_beside(group, name, hand, landmarks)) >= LEAST_FIT
        ]
        if of_hand:
            found[name] = max(of_hand, key=lambda one: one[0])[1]
    return found


def _stirring(patch: Patch) -> float:
    """A wrist stirs more than what hangs on the wall."""
    return _LEAST_CLEAR + patch.moved


def _hand_boxes(hand: Sequence[Group]) -> dict[int, Box]:
    """Of each picture, where the rest of a hand is that has these markers."""
    found: dict[int, Box] = {}
    for frame in {patch.frame for group in hand for patch in group}:
        boxes = np.array([p.box for group in hand for p in group if p.frame == frame])
        low, high = boxes[:, :2].min(axis=0), (boxes[:, :2] + boxes[:, 2:]).max(axis=0)
        reach = int(_HAND_REACH * (high - low).max())
        (x, y), (width, height) = (low - reach).tolist(), (high - low + 2 * reach).tolist()
        found[frame] = (x, y, width, height)
    return found


def _proposal(name: str, group: Group) -> Proposal:
    boxes = tuple(
        Pointer(name, patch.frame, *patch.box)
        for patch in sorted(group, key=lambda patch: patch.frame)
    )
    moves = 2 * sum(patch.moves for patch in group) > len(group)
    return Proposal(name, round(hue_of(group), 1), len(boxes), boxes, moves)


def for_markers(
    proposals: Sequence[Proposal], wanted: Sequence[str]
) -> tuple[list[Proposal], list[str]]:
    """Those of the colours that markers need, all if these are none; and colours that none has."""
    if not wanted:
        return list(proposals), []
    found = {one.color for one in proposals}
    missing = [color for color in wanted if color not in found]
    return [one for one in proposals if one.color in wanted], missing


def boxes_of(proposals: Sequence[Proposal]) -> list[Pointer]:
    """All pointers of several proposals."""
    return [box for proposal in proposals for box in proposal.boxes]
