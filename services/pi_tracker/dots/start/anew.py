"""A hand that was lost, found again as it was when all of it was seen last. Pure.

A hand of which little was seen for seconds is not where the account that carried it on has it: its
dots are missing, and what they are seen as belongs to nobody. People open a hand as they closed it,
so it is looked for in the posture that it had when nearly all of its dots were seen, moved and bent
by any amount that is likely. What comes of it goes with the other accounts, and the pictures that
follow tell whether it is right.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.body.body import Body
from services.pi_tracker.dots.extend import extend, searched
from services.pi_tracker.dots.hypothesis import Hypothesis, Patches, Surroundings, pruned
from services.pi_tracker.dots.search import Search

Array = npt.NDArray[np.float64]

# A hand is lost where dots are missed and as many patches of a dot's size are nobody's: so many of
# them, counted in pictures in a row. It is known where this share of its dots was seen, each alone,
# in so many pictures, and at the start. (Clips of 15 dots, the tuning half of
# benchmarks/dots_pictures.py: one that waves, lost for good after five pictures, 12 % right, known
# from the start 52. Later, with 6 and 5 instead of 3 and 3, and two pictures of rest after each
# search, it was 42 and two that grab 79 and 90, and are 55, 78 and 92 so.)
_LOST, _MOST, _KNOWN = 3, 0.8, 3
# Where no more than this share of them was seen a hand may be anything when it comes out again.
_FEW = 0.6
# No dot is smaller than this share of a whole one.
_SPECK = 0.3
# A hand comes back within so much (sigma) of where it was, turned and bent by so much, m and
# rad, or by these shares of it. (The same clips: with 1 alone 93.4 %.)
_PLACE_M, _TURN_RAD, _BENT_RAD = 0.06, 0.3, 0.4
_SHARES = (0.5, 1.0, 2.0)
# Log probability that a hand is somewhere else than where it was followed to.
_ELSEWHERE = -10.0
# It has come to rest meanwhile, s.
_MEANWHILE_S = 0.5
# Patches that were nobody's go on as such, and cost less than dots that may be anywhere. So many
# pictures are to tell; what makes so many of them likelier by this (nats) is believed.
_TRIED, _JUDGED, _BETTER = 8, 3, 10.0
_SEARCH = Search(beam=192, updated=12)


class LastKnown:
    """The account that saw nearly all of a hand last, and whether the hand is lost."""

    def __init__(self) -> None:
        self._known: Hypothesis | None = None
        # What tracking starts with is known.
        self._seen, self._few, self._lost = _KNOWN, _KNOWN, 0
        # Accounts that begin with it, their scores beside the best of the others, which is 0.
        self._rivals: list[Hypothesis] = []
        self._ahead: list[float] = []

    def note(self, best: Hypothesis, areas: Array, whole: Array) -> None:
        """The likeliest account of a picture; areas (m,) of its patches, whole (n,) of dots."""
        told = list(best.patch)
        alone = sum(patch >= 0 and told.count(patch) == 1 for patch in told)
        self._seen = self._seen + 1 if alone >= _MOST * len(told) else 0
        if self._seen >= _KNOWN:
            self._known = best
        self._few = 0 if alone < _FEW * len(told) else self._few + 1
        large = np.flatnonzero(areas >= _SPECK * float(np.median(whole)))
        lost = min(told.count(-1), len(set(large.tolist()) - set(told)))
        self._lost = self._lost + lost if lost else 0
        if len(large) >= _MOST * len(told) and self._few in range(1, _KNOWN):
            # It comes out again.
            self._lost = max(self._lost, _LOST)

    def against(
        self,
        found: list[Hypothesis],
        parent: Hypothesis,
        patches: Patches,
        around: Surroundings,
        elapsed_s: float,
        search: Search,
    ) -> list[Hypothesis]:
        """The accounts `found` of a picture, or those of a hand as it was known if it is likelier.

        parent is the likeliest account of the picture before.
        """
        if self._rivals:
            rivals = searched(self._rivals, patches, around, elapsed_s, search)
        elif self._known is not None and self._lost >= _LOST:
            rivals = self._begun(self._known, parent, patches, around)
        else:
            return found
        best = max(one.score for one in found)
        ahead = max(one.score for one in rivals) - best
        self._ahead.append(ahead)
        gained = ahead - self._ahead[-1 - _JUDGED] if len(self._ahead) > _JUDGED else 0.0
        if ahead > 0.0 or gained > _BETTER:
            self._rivals, self._lost, self._ahead = [], 0, []
            return rivals
        self._rivals = [replace(one, score=one.score - best) for one in rivals]
        if len(self._ahead) >= _TRIED:
            self._rivals, self._ahead = [], []
        return found

    def _begun(
        self, known: Hypothesis, parent: Hypothesis, patches: Patches, around: Surroundings
    ) -> list[Hypothesis]:
        """A hand as it was known, in the next picture; `parent` says what was before."""
        begun = replace(
            known,
            score=parent.score,
            unseen=parent.unseen,
            # What was nobody's may well be its dots.
            false=np.zeros((0, 2)),
            patch=parent.patch,
            way=parent.way,
        )
        ways = tuple((_moved(around.body, share), _ELSEWHERE) for share in _SHARES)
        anywhere = Surroundings(around.body, ways, around.false_density)
        return pruned(extend([begun], patches, anywhere, _MEANWHILE_S, _SEARCH), _SEARCH)


def _moved(body: Body, share: float) -> Array:
    """What a covariance (d, d) grows by while a hand is out of sight, at a share of the usual."""
    moving, size = body.moving, body.size
    cov = np.zeros((size + moving, size + moving))
    cov[:3, :3] = _PLACE_M**2 * np.eye(3)
    cov[3:6, 3:6] = _TURN_RAD**2 * np.eye(3)
    cov[6:moving, 6:moving] = _BENT_RAD**2 * body.shares
    cov *= share**2
    cov[size:, size:] = motion.any_speed(body)
    return cov
