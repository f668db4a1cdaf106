"""Pairwise consistency of markers: those of one hand are near each other and of one size.

Pure. Which blob of each colour belongs to the hand is decided for all colours together. Single
blobs in the background may be consistent with each other, too; so the set with the largest sum of
pairwise consistency wins, and where it is known which landmarks the colours mark, their layout
counts (hand_layout.py). With one colour only there are no pairs, and the blob of the largest prior
wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.pi_tracker.identify.hand_layout import HandLayout, Ints
from services.pi_tracker.image.blob import Blob

# Wrist to finger tip is 180 mm, thumb to little finger spread 200 mm; paint patches are 12 to 16 mm
# wide: markers lie within 14 patch widths, mostly within 10.
_REACH_WIDTHS = 14.0
# Tips seen end on or half occluded and a dab on the wrist seen in full differ in area up to this.
SIZE_RATIO = 4.0
# Within that, those of one size are likelier to be one hand's: power of the ratio of areas, where
# their layout is known and where it is not. (First pictures of 120 simulated rooms with things in
# the paints' colours, of 1387 tips: 89.3 % right with .2 and no layout, 90.9 with .5, 90.6 with 1;
# with the layout 96.5, 96.0 and 94.9 with .25, .5 and 1.)
_LIKE_SIZE, _LIKE_SIZE_LAID_OUT = 0.5, 0.25
# Weight of the priors beside the pairs' consistency, so that lone markers count.
_PRIOR_WEIGHT = 0.01


class Candidate(NamedTuple):
    """A blob with its prior, 0..1: what its own track says of it.

    whole_px2 is the area to compare with other markers, where another occludes part of it; 0: its
    own.
    """

    blob: Blob
    prior: float
    whole_px2: float = 0.0

    @property
    def whole(self) -> Blob:
        """The blob as it would be if nothing occluded it."""
        return self.blob._replace(area_px=self.whole_px2) if self.whole_px2 else self.blob


def most_consistent_set(
    candidates: Sequence[Sequence[Candidate]], layout: HandLayout
) -> list[tuple[Candidate, float] | None]:
    """One candidate of each colour, and its consistency with the others of the set.

    None where a colour has no candidate; consistency is 0..1, and 1 if alone. Each candidate in
    turn is the anchor of a set, which takes of every other colour the candidate most consistent
    with the anchor. The set of the largest score wins: the sum of pairwise weights, each times both
    priors, and a little of each prior.
    """
    flat = [candidate for own in candidates for candidate in own]
    if not flat:
        return [None] * len(candidates)
    blobs, priors = [one.whole for one in flat], np.array([one.prior for one in flat])
    pairs = _pairs(blobs)
    weights = _weights(pairs, np.array([blob.color for blob in blobs]), layout)
    members = _members(weights * priors, [len(own) for own in candidates])  # (n, colours)
    given = priors[members]
    between = weights[members[:, :, None], members[:, None, :]]
    scores = _PRIOR_WEIGHT * given.sum(axis=1)
    scores += 0.5 * np.einsum("ni,nij,nj->n", given, between, given)
    best = members[int(np.argmax(scores))]
    consistencies = _consistencies(pairs)
    found = iter(best.tolist())
    return [
        (flat[n := next(found)], _mean_with(consistencies, n, best)) if own else None
        for own in candidates
    ]


class _Pairs(NamedTuple):
    """Of each two of n blobs (n, n): squared distance, px^2, and the smaller and larger area."""

    distance2: Array
    smaller: Array
    larger: Array


def _pairs(blobs: Sequence[Blob]) -> _Pairs:
    x, y, area = np.array([(one.x_px, one.y_px, max(one.area_px, 1.0)) for one in blobs]).T
    distance2 = np.subtract.outer(x, x) ** 2 + np.subtract.outer(y, y) ** 2
    return _Pairs(distance2, np.minimum.outer(area, area), np.maximum.outer(area, area))


def _members(likings: Array, counts: Sequence[int]) -> Ints:
    """Of each anchor (a row) and each colour that has candidates the one it likes most; (n, c).

    Of its own colour it likes itself.
    """
    columns, first = [], 0
    for count in counts:
        if count:
            column = first + np.argmax(likings[:, first : first + count], axis=1)
            column[first : first + count] = np.arange(first, first + count)
            columns.append(column)
        first += count
    return np.stack(columns, axis=1)


def _mean_with(consistencies: Array, n: int, members: Ints) -> float:
    """Mean of one's consistency with the other members; 1 if there are none."""
    others = members[members != n]
    return float(consistencies[n, others].mean()) if len(others) else 1.0


def _consistencies(pairs: _Pairs) -> Array:
    """How well distances and sizes are those of markers on one hand, 0..1; (n, n)."""
    # Of two sizes the smaller one is less often wrong: background and blur make blobs large.
    nearness = 1.0 / (1.0 + (pairs.distance2 / (_REACH_WIDTHS**2 * pairs.smaller)) ** 2)
    return nearness * np.minimum(1.0, SIZE_RATIO * pairs.smaller / pairs.larger)


def _weights(pairs: _Pairs, colors: Ints, layout: HandLayout) -> Array:
    """Consistencies, more of those of like sizes: to choose between sets, not to judge one; (n, n).

    Nothing of a blob and itself.
    """
    likeness = pairs.smaller / pairs.larger
    nearness = layout.nearness(colors, pairs.distance2, np.sqrt(pairs.smaller * pairs.larger))
    weights = np.where(
        np.isnan(nearness),
        _consistencies(pairs) * likeness**_LIKE_SIZE,
        nearness * likeness**_LIKE_SIZE_LAID_OUT,
    )
    np.fill_diagonal(weights, 0.0)
    return weights
