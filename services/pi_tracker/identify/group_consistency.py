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

from services.pi_tracker.identify.hand_layout import HandLayout
from services.pi_tracker.image.blob import Blob

# Wrist to finger tip is 180 mm, thumb to little finger spread 200 mm; paint patches are 12 to 16 mm
# wide: markers lie within 14 patch widths, mostly within 10.
_REACH_WIDTHS = 14.0
# Tips seen end on or half occluded and a dab on the wrist seen in full differ in area up to this.
_SIZE_RATIO = 4.0
# Within that, those of one size are likelier to be one hand's: power of the ratio of areas, where
# their layout is known and where it is not. (First pictures of 120 simulated rooms with things in
# the paints' colours, of 1387 tips: 91.1 % right with .2 and no layout, 90.9 with .5, 90.6 with 1;
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
    with the anchor. The set of the largest score wins.
    """
    best: list[Candidate | None] = [
        max(own, key=lambda c: c.prior, default=None) for own in candidates
    ]
    best_score = -1.0
    for anchor in (candidate for own in candidates for candidate in own):
        members = [_partner(anchor, own, layout) for own in candidates]
        score = _set_score([one for one in members if one is not None], layout)
        if score > best_score:
            best, best_score = members, score
    return [None if member is None else (member, _in_set(member, best)) for member in best]


def consistency(blob: Blob, others: Sequence[Blob]) -> float:
    """Mean pairwise consistency of a blob with others, 0..1; 1 if there are none."""
    if not others:
        return 1.0
    return sum(_pair_consistency(blob, other) for other in others) / len(others)


def _partner(anchor: Candidate, own: Sequence[Candidate], layout: HandLayout) -> Candidate | None:
    """The candidate of a colour that is most consistent with the anchor; of its own, itself."""
    if any(candidate is anchor for candidate in own):
        return anchor
    return max(
        own, key=lambda c: c.prior * _pair_weight(anchor.whole, c.whole, layout), default=None
    )


def _set_score(members: Sequence[Candidate], layout: HandLayout) -> float:
    """Sum of pairwise consistencies, each weighted with both priors, and a little of each prior."""
    score = _PRIOR_WEIGHT * sum(member.prior for member in members)
    for i, a in enumerate(members):
        for b in members[:i]:
            score += _pair_weight(a.whole, b.whole, layout) * a.prior * b.prior
    return score


def _in_set(member: Candidate, members: Sequence[Candidate | None]) -> float:
    others = [other for other in members if other is not None and other is not member]
    return consistency(member.whole, [other.whole for other in others])


def _pair_consistency(a: Blob, b: Blob) -> float:
    """How well distance and size of two blobs are those of markers on one hand, 0..1."""
    area_a, area_b = a.area_px, b.area_px
    smaller, larger = (area_a, area_b) if area_a < area_b else (area_b, area_a)
    distance2 = (a.x_px - b.x_px) ** 2 + (a.y_px - b.y_px) ** 2
    # Of two sizes the smaller one is less often wrong: background and blur make blobs large.
    nearness = 1.0 / (1.0 + (distance2 / (_REACH_WIDTHS**2 * smaller)) ** 2)
    return nearness * min(1.0, _SIZE_RATIO * smaller / larger)


def _pair_weight(a: Blob, b: Blob, layout: HandLayout) -> float:
    """Their consistency, more of those of like sizes: to choose between sets, not to judge one."""
    smaller, larger = sorted((a.area_px, b.area_px))
    likeness, nearness = smaller / max(larger, 1.0), layout.nearness(a, b)
    if nearness is None:
        return _pair_consistency(a, b) * likeness**_LIKE_SIZE
    return nearness * likeness**_LIKE_SIZE_LAID_OUT
