"""Markers keep company: those of one hand lie within a hand's reach of each other and are of one
size.

Pure. Which blob of each colour belongs to the hand is decided for all colours together, as things
in the room keep company, too: the set whose members fit each other best wins. With one colour only
there is no company, and the likeliest blob wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from services.pi_tracker.detect.blob_search import Blob

# Wrist to finger tip is 180 mm, thumb to little finger spread 200 mm; paint patches are 12 to 16 mm
# wide: markers lie within 14 patch widths, mostly within 10.
_REACH_WIDTHS = 14.0
# Tips seen end on or half hidden and a dab on the wrist seen in full differ in area up to this.
_SIZE_RATIO = 4.0


@dataclass(frozen=True, eq=False)
class Candidate:
    """A blob with what its own track says of it, 0..1.

    whole_px2 is the area with which it keeps company, where another marker hides part of it; 0: its
    own.
    """

    blob: Blob
    prior: float
    whole_px2: float = 0.0

    @property
    def company(self) -> Blob:
        """The blob as it would be if nothing hid it."""
        return self.blob._replace(area_px=self.whole_px2) if self.whole_px2 else self.blob


def best_set(candidates: Sequence[Sequence[Candidate]]) -> list[tuple[Candidate, float] | None]:
    """One candidate of each colour, or None where there is none, with its fit to the others of the
    set, 0..1 (1 if alone).

    Each candidate in turn gathers the best of every other colour about itself; the gathering with
    the largest sum of pairwise fits, each weighted with both priors, wins.
    """
    best: list[Candidate | None] = [
        max(own, key=lambda c: c.prior, default=None) for own in candidates
    ]
    best_score = -1.0
    for anchor in (candidate for own in candidates for candidate in own):
        members = [_gathered(anchor, own) for own in candidates]
        score = _total([member for member in members if member is not None])
        if score > best_score:
            best, best_score = members, score
    return [None if member is None else (member, _support(member, best)) for member in best]


def support(blob: Blob, others: Sequence[Blob]) -> float:
    """How well a blob fits others, mean over them, 0..1; 1 if there are none."""
    return sum(_fit(blob, other) for other in others) / len(others) if others else 1.0


def _gathered(anchor: Candidate, own: Sequence[Candidate]) -> Candidate | None:
    if any(candidate is anchor for candidate in own):
        return anchor
    return max(own, key=lambda c: c.prior * _fit(anchor.company, c.company), default=None)


def _total(members: Sequence[Candidate]) -> float:
    """Sum of fits over pairs and, so that lone markers count, a little of each prior."""
    total = 0.01 * sum(member.prior for member in members)
    for i, a in enumerate(members):
        for b in members[:i]:
            total += _fit(a.company, b.company) * a.prior * b.prior
    return total


def _support(member: Candidate, members: Sequence[Candidate | None]) -> float:
    return support(
        member.company,
        [other.company for other in members if other is not None and other is not member],
    )


def _fit(a: Blob, b: Blob) -> float:
    area_a, area_b = a.area_px, b.area_px
    smaller, larger = (area_a, area_b) if area_a < area_b else (area_b, area_a)
    apart2 = (a.x_px - b.x_px) ** 2 + (a.y_px - b.y_px) ** 2
    # Of two sizes the smaller one is less often wrong: things in the room and blur make blobs
    # large.
    near = 1.0 / (1.0 + (apart2 / (_REACH_WIDTHS**2 * smaller)) ** 2)
    return near * min(1.0, _SIZE_RATIO * smaller / larger)
