"""The likely assignments of a picture's patches to the dots of one hypothesis. Pure.

First each dot's patch by the past alone, and by the shift of all that most dots agree on (a hand
that jerks takes all its dots along); both are refined until each dot has the patch that the others
expect it at. Then what differs from the best by one exchange.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots.assignment import assign
from services.pi_tracker.dots.hypothesis import Hypothesis, Patches, Surroundings, View

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# Sharper accelerations are looked at only where a picture is explained badly: innovations squared
# for each degree of freedom (their mean is 1), or dots that are lost.
_CALM = 3.0
# Rounds of refinement. Exchanges that may cost this much (nats) are looked at, and so many at most.
_ROUNDS, _EXCHANGE_NATS, _MAX_EXCHANGES = 3, 12.0, 8


def extend(
    parent: Hypothesis, patches: Patches, around: Surroundings, elapsed_s: float, least: float
) -> list[Hypothesis]:
    """What a hypothesis may become, the likely ones, in no order; at least one.

    least: what scores less than this is of no use any more.
    """
    children: list[Hypothesis] = []
    for acceleration, prior in around.accelerations:
        view = View(parent, patches, around, elapsed_s, acceleration, prior)
        children += _children(view, max(least, max(map(_score, children), default=-np.inf) - 12.0))
        best = max(children, key=_score)
        lost = sum(now < 0 <= was for now, was in zip(best.patch, parent.patch, strict=True))
        if best.squared <= _CALM and not lost:
            break
    return children


def _children(view: View, least: float) -> list[Hypothesis]:
    if not len(view.patches.areas):
        return [view.extended(np.full(len(view.state.positions), -1, np.int64))]
    found: dict[tuple[int, ...], Hypothesis] = {}

    def add(patch: Indices) -> None:
        patch = view.with_merged(patch)
        key = tuple(patch.tolist())
        if key not in found:
            found[key] = view.extended(patch)

    for patch in _starts(view):
        add(patch)
    best = max(found.values(), key=_score)
    for patch in _exchanges(view, np.array(best.patch), max(least - best.score, -_EXCHANGE_NATS)):
        add(patch)
    return list(found.values())


def _starts(view: View) -> list[Indices]:
    places, spreads = view.marginal()
    starts = [assign(view.gains(places, spreads))]
    shifted = places + _common_shift(view, places, spreads)
    # Where all have moved alike, each is within about a tenth of its own gate.
    starts.append(assign(view.gains(shifted, 0.1 * spreads)))
    refined = []
    for patch in starts:
        for _ in range(_ROUNDS):
            better = assign(view.gains(*view.given(patch)))
            if np.array_equal(better, patch):
                break
            patch = better
        refined.append(patch)
    return refined


def _common_shift(view: View, places: Array, spreads: Array) -> Array:
    """The shift (2,) that brings most dots to patches."""
    shifts = view.patches.places[None] - places[:, None]  # (n, m, 2)
    near = np.sum(shifts**2, axis=2) < 16.0 * spreads[:, None]
    candidates = shifts[near]
    if not len(candidates):
        return np.zeros(2)
    width = 0.01 * float(spreads.mean()) + 4.0
    apart = np.sum((candidates[:, None, None] - shifts[None]) ** 2, axis=3)  # (c, n, m)
    votes = np.exp(-0.5 * apart / width).max(axis=2).sum(axis=1)
    best: Array = candidates[int(votes.argmax())]
    return best


def _exchanges(view: View, patch: Indices, least: float) -> list[Indices]:
    """Assignments that differ by one exchange, that gain about `least` or more."""
    if least > 0.0:
        return []
    gains = view.gains(*view.given(patch))
    count, columns = gains.shape
    # A dot that shares a patch gains nothing by it that another would lose.
    padded = np.concatenate([gains, np.zeros((count, 1))], axis=1)
    now = padded[np.arange(count), patch]
    free = np.setdiff1d(np.arange(columns), patch)
    moves: list[tuple[float, list[tuple[int, int]]]] = []
    for dot in range(count):
        own = float(now[dot])
        if patch[dot] >= 0:
            moves.append((-own, [(dot, -1)]))
        moves += [(float(gains[dot, to]) - own, [(dot, int(to))]) for to in free]
        for other in range(count):
            if patch[other] < 0 or patch[other] == patch[dot]:
                continue
            taken = float(gains[dot, patch[other]])
            if patch[dot] < 0:
                delta = taken - float(now[other])
                moves.append((delta, [(dot, int(patch[other])), (other, -1)]))
            elif dot < other:
                delta = taken + float(gains[other, patch[dot]]) - own - float(now[other])
                moves.append((delta, [(dot, int(patch[other])), (other, int(patch[dot]))]))
    likely = sorted((move for move in moves if move[0] > least), key=lambda move: -move[0])
    result = []
    for _, changes in likely[:_MAX_EXCHANGES]:
        changed = patch.copy()
        for dot, to in changes:
            changed[dot] = to
        result.append(changed)
    return result


def _score(hypothesis: Hypothesis) -> float:
    return hypothesis.score
