"""Mix-ups undone that no kept account has: two dots' names exchanged where the shape asks for it.

Pure. While two dots cross, what speaks for either account may be little, and the right one may be
dropped. Later the shape of the hand tells: bones are too long, a finger bends both ways. Then the
account with the two names exchanged enters beside the others, and the next pictures decide.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.chains import Chains
from services.pi_tracker.dots.hypothesis import Hypothesis
from services.pi_tracker.dots.shape import strain

# Less strain is as a shape may be by chance; an exchange must take off at least so much, and the
# account that it leads to begins so much less likely than the one it is made from.
_STRAINED, _RELIEF, _DOUBT = 2.5, 2.0, 4.0
_MOST = 3


def repaired(best: Hypothesis, chains: Chains) -> list[Hypothesis]:
    """The best account with two names exchanged, where that makes its shape far likelier."""
    places, known = best.state.positions, np.array(best.patch) >= 0
    exact = np.zeros(len(known))
    now = strain(chains, places, known, exact, best.lengths)
    if now < _STRAINED:
        return []
    found = []
    for a in range(len(known)):
        for b in range(a + 1, len(known)):
            if not (known[a] or known[b]) or best.patch[a] == best.patch[b]:
                continue
            order = np.arange(len(known))
            order[[a, b]] = b, a
            relief = now - strain(chains, places[order], known[order], exact, best.lengths)
            if relief > _RELIEF:
                found.append((relief, order))
    found.sort(key=lambda one: -one[0])
    return [_exchanged(best, order) for _, order in found[:_MOST]]


def _exchanged(best: Hypothesis, order: npt.NDArray[np.int64]) -> Hypothesis:
    count = len(order)
    rows = np.concatenate([order, count + order])
    # Whose dot a velocity is was as wrong as whose place: both go along.
    state = motion.State(best.state.mean[rows], best.state.cov[np.ix_(rows, rows)])
    return replace(
        best,
        score=best.score - _DOUBT,
        state=state,
        unseen=best.unseen[order],
        patch=tuple(best.patch[k] for k in order),
    )
