"""Which paint each patch is, where hues alone leave it open: markers are where a hand has them.

Warm light turns blue to violet and violet to magenta, and a green ball that the wrist hides now and
then moves: what is named so must also be as far from the others as rig.toml's landmarks are. Pure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from services.pi_tracker.colors.proposal.paint_names import Choose, with_most_gain
from services.pi_tracker.colors.proposal.patch_groups import Group
from services.pi_tracker.colors.proposal.vivid_patches import Patch
from services.pi_tracker.identify.hand_layout import HandLayout, Landmarks
from services.pi_tracker.image.hue import Array

# What a pair of markers costs by the logarithm of how near it is to a hand's, where a name that
# fits to the hue gains 60; and how unlikely a pair can be at most. Set by hand.
_PER_LOG, _MOST_UNLIKELY = 5.0, 4.0
# What is no nearer to where a hand has a marker, or so many times as large as those that were
# found, is not proposed for it: a colour that is missing is told, one that is on a poster is not.
# On 48 tuning rooms and the other renderer's tuning clips things are proposed for 41 of 960 paints
# without either, 27 with both, and no paint is lost. (Also tried: .3, and 4 times, 28.)
LEAST_FIT, _MOST_LARGER = 0.1, 3.0
# So many groups may be markers, those that gain most: all ways to name more take too long.
_MOST_GROUPS = 10


def of_a_hand(groups: Sequence[Group], landmarks: Landmarks) -> Choose:
    """Names by hues and by where landmarks are."""

    def choose(gains: Array, names: Sequence[str]) -> list[int]:
        pairs, shares = _pairs(groups, names, landmarks)
        return _best_names(gains, _PER_LOG * shares[:, None, :, None] * pairs)

    return choose


def fit_beside(group: Group, name: str, hand: Mapping[str, Group], landmarks: Landmarks) -> float:
    """How well a group of that name is where a hand with these markers would have it, 0..1; 0 if it
    is much larger than they are.
    """
    if _times_larger(group, hand.values()) > _MOST_LARGER:
        return 0.0
    pairs, shares = _pairs([group, *hand.values()], [name, *hand], landmarks)
    others = np.arange(1, len(hand) + 1)
    total = float(shares[0, 1:].sum())
    return math.exp(float(pairs[0, 0, others, others] @ shares[0, 1:]) / total) if total else 1.0


def _times_larger(group: Group, others: Iterable[Group]) -> float:
    """Than others' typical patch in the same picture, the median; 0 if no picture has any."""
    sizes: dict[int, list[int]] = {}
    for patch in (patch for other in others for patch in other):
        sizes.setdefault(patch.frame, []).append(patch.cells)
    ratios = [
        patch.cells / float(np.median(sizes[patch.frame]))
        for patch in group
        if patch.frame in sizes
    ]
    return float(np.median(ratios)) if ratios else 0.0


def beside_hand(groups: Sequence[Group], hand: Mapping[str, Group], landmarks: Landmarks) -> Choose:
    """Names by hues, of what may be where a hand with these markers has them."""

    def choose(gains: Array, names: Sequence[str]) -> list[int]:
        allowed = gains.copy()
        for number, column in np.argwhere(gains > 0.0).tolist():
            group, name = groups[number], names[column]
            # What marks no landmark is a thing of the room, and may be anywhere.
            if name in landmarks and fit_beside(group, name, hand, landmarks) < LEAST_FIT:
                allowed[number, column] = 0.0
        return with_most_gain(allowed, names)

    return choose


def _pairs(
    groups: Sequence[Group], names: Sequence[str], landmarks: Landmarks
) -> tuple[Array, Array]:
    """How near pairs are to a hand's: logarithms, 0 or less, of two groups that have two names:
    (groups, names, groups, names), the mean over pictures that have both, 0 where nothing is known;
    and the share of these pictures of all (groups, groups).
    """
    count, each = len(groups), len(names)
    total, both = np.zeros((count * each, count * each)), np.zeros((count, count))
    layout = HandLayout(names, landmarks)
    colors, square = np.tile(np.arange(each), count), np.ones((each, each))
    pictures = {patch.frame for group in groups for patch in group}
    for picture in pictures:
        seen = [
            next((patch for patch in group if patch.frame == picture), None) for group in groups
        ]
        middles_px = np.array([_middle(patch) for patch in seen]).reshape(count, 2)
        areas_px2 = np.array([4.0 * patch.cells if patch else math.nan for patch in seen])
        distance2 = np.sum((middles_px[:, None] - middles_px) ** 2, axis=2)
        area_px2 = np.sqrt(areas_px2[:, None] * areas_px2)
        near = layout.nearness(colors, np.kron(distance2, square), np.kron(area_px2, square))
        total += np.nan_to_num(np.maximum(np.log(np.maximum(near, 1e-9)), -_MOST_UNLIKELY))
        both += np.isfinite(distance2)
    logs = total / np.maximum(np.kron(both, square), 1.0)
    return logs.reshape(count, each, count, each), both / max(len(pictures), 1)


def _best_names(gains: Array, pairs: Array) -> list[int]:
    """The name of each group that makes most of both gains, -1 for none; none is given twice.

    gains (groups, names): one that is not above 0 is never taken. All choices are gone through, but
    for those that cannot become better than the best so far.
    """
    most = gains.max(axis=1, initial=0.0)
    order = np.argsort(-most, kind="stable")[:_MOST_GROUPS].tolist()
    # What all groups from one on may still bring.
    bounds = [float(most[order[depth:]].sum()) for depth in range(len(order) + 1)]
    best, most_yet = [-1] * len(gains), 0.0
    given: dict[int, int] = {}

    def go_on(depth: int, gain: float) -> None:
        nonlocal best, most_yet
        if gain > most_yet:
            best, most_yet = [given.get(group, -1) for group in range(len(gains))], gain
        if gain + bounds[depth] <= most_yet or depth == len(order):
            return
        group = order[depth]
        for name in np.flatnonzero(gains[group] > 0.0).tolist():
            if name not in given.values():
                beside = sum(float(pairs[group, name, *other]) for other in given.items())
                given[group] = name
                go_on(depth + 1, gain + float(gains[group, name]) + beside)
                del given[group]
        go_on(depth + 1, gain)

    go_on(0, 0.0)
    return best


def _middle(patch: Patch | None) -> tuple[float, float]:
    """Of its box, px; NaN if there is none."""
    if patch is None:
        return math.nan, math.nan
    x, y, width, height = patch.box
    return x + 0.5 * width, y + 0.5 * height
