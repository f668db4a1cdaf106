"""Patches of several pictures that are one marker's, by their hue. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from services.pi_tracker.colors.proposal.vivid_patches import Box, Patch
from services.pi_tracker.image.hue import hue_difference, mean_hue

# Patches of one marker in several pictures differ less in hue, markers of different paint more.
_SAME_HUE = 7.0
# A marker's salience is at least this share of the most salient one's: the simulator's a quarter,
# its dark corners a tenth; the gaps between the fingers that hold a pastel ball a ninth.
_MIN_SALIENCE_SHARE = 0.2

Group = list[Patch]


def clearness(patch: Patch) -> float:
    """How clearly it moves or stands still, 0..1: a hand hides things at times, in others not."""
    return abs(2.0 * patch.moved - 1.0)


def salient_groups(
    patches: Iterable[Patch],
    pictures: float,
    markers: Sequence[Group] = (),
    weight: Callable[[Patch], float] = clearness,
) -> list[Group]:
    """Patches of one marker each, seen in so many pictures or more, most salient first.

    markers: groups that say how salient markers are; none: these patches themselves. weight: of a
    patch's salience where several may be the same marker.
    """
    groups = [group for group in _grouped_by_hue(patches, weight) if len(group) >= pictures]
    groups.sort(key=lambda group: importance(group, weight), reverse=True)
    largest = max(map(_salience, markers or groups), default=0.0)
    salient = [group for group in groups if _salience(group) >= _MIN_SALIENCE_SHARE * largest]
    return [
        group
        for number, group in enumerate(salient)
        if not any(_is_same_object(group, other) for other in salient[:number])
    ]


def hue_of(group: Group) -> float:
    """Its mean, larger patches counting more."""
    return mean_hue(
        np.array([patch.hue for patch in group]),
        np.array([float(patch.cells) for patch in group]),
    )


def median_of(group: Group, weight: Callable[[Patch], float]) -> float:
    """Of its patches."""
    return float(np.median([weight(patch) for patch in group]))


def importance(group: Group, weight: Callable[[Patch], float]) -> float:
    """How much it stands out, by a weight of its patches."""
    return median_of(group, weight) * _salience(group)


def has_hue_of(patch: Patch, groups: Iterable[Group]) -> bool:
    """Whether a patch may belong to one of them."""
    return any(_is_same_hue(patch, group[0]) for group in groups)


def overlap(a: Box, b: Box) -> bool:
    """Whether half of the smaller box lies in the other; touching fingers' boxes overlap less."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return min(width, height) > 0 and 2 * width * height > min(a[2] * a[3], b[2] * b[3])


def _grouped_by_hue(patches: Iterable[Patch], weight: Callable[[Patch], float]) -> list[Group]:
    """Patches of like hue, one per picture, the most salient first."""
    groups: list[Group] = []
    for patch in sorted(patches, key=lambda patch: patch.salience * weight(patch), reverse=True):
        near = next((group for group in groups if _is_same_hue(patch, group[0])), None)
        if near is None:
            groups.append([patch])
        elif all(other.frame != patch.frame for other in near):
            near.append(patch)
    return groups


def _is_same_hue(a: Patch, b: Patch) -> bool:
    return abs(hue_difference(a.hue, b.hue)) <= _SAME_HUE


def _salience(group: Group) -> float:
    return median_of(group, lambda patch: patch.salience)


def _is_same_object(group: Group, stronger: Group) -> bool:
    """Whether one object's light and dark sides were taken for two.

    Then their boxes overlap in most pictures.
    """
    stronger_boxes = {patch.frame: patch.box for patch in stronger}
    own_boxes = {patch.frame: patch.box for patch in group}
    overlapping = sum(
        overlap(box, stronger_boxes[frame])
        for frame, box in own_boxes.items()
        if frame in stronger_boxes
    )
    return 2 * overlapping > len(own_boxes)
