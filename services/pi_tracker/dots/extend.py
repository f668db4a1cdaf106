"""The likely assignments of a picture's patches to the dots of several accounts. Pure.

First each dot's patch by the past alone, and by the shift of all that most dots agree on (a hand
that jerks takes all its dots along); both are refined until each dot has the patch that the others
expect it at. Then what differs from the best by one exchange. The likeliest are updated exactly.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.assignment import assign
from services.pi_tracker.dots.hypothesis import Ahead, Hypothesis, Patches, Surroundings, View

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# Sharper accelerations are looked at only where a picture is explained badly: innovations squared
# for each degree of freedom (their mean is below 1), or dots that are lost.
_CALM = 2.0
# Rounds of refinement. Exchanges that may cost this much (nats) are looked at, and so many at most.
_ROUNDS, _EXCHANGE_NATS, _MAX_EXCHANGES = 4, 10.0, 8
# So many are updated, and none that is so much (nats) less likely than the best.
_UPDATED, _WORSE_NATS = 24, 24.0


def extend(
    parents: list[Hypothesis], patches: Patches, around: Surroundings, elapsed_s: float
) -> list[Hypothesis]:
    """What hypotheses may become, the likely ones, in no order; at least one."""
    skeleton = around.skeleton
    ahead = motion.coasted(skeleton, motion.together([p.state for p in parents]), elapsed_s)
    found: list[tuple[float, View, Indices]] = []
    for levels in _views(parents, ahead, patches, around):
        found += _children(levels)
    found.sort(key=lambda one: -one[0])
    likely = [one for one in found[:_UPDATED] if one[0] > found[0][0] - _WORSE_NATS]
    before = motion.together([view.ahead.state for _, view, _ in likely])
    measured = zip(*(view.measured(patch) for _, view, patch in likely), strict=True)
    seen, places, variances = (np.array(part) for part in measured)
    after = motion.updated(skeleton, before, seen, places, variances)
    return [
        view.become(patch, after.state.take([k]), float(after.nats[k]))
        for k, (_, view, patch) in enumerate(likely)
    ]


def _views(
    parents: list[Hypothesis], state: motion.State, patches: Patches, around: Surroundings
) -> Iterator[Iterator[View]]:
    """Of each parent a view for each acceleration; state: the parents' when nothing accelerates."""
    pixels, slopes = around.skeleton.project(state.means, state.rotations, state.sides)
    for k, parent in enumerate(parents):
        rows = slopes[k].reshape(-1, around.skeleton.size)
        yield _levels(parent, pixels[k], rows, state.take([k]), patches, around)


def _levels(
    parent: Hypothesis,
    pixels: Array,
    rows: Array,
    still: motion.State,
    patches: Patches,
    around: Surroundings,
) -> Iterator[View]:
    """One parent's views, made as they are asked for: a calm picture needs the first alone.

    Its dots' pixels (n, 2) and their derivatives (2n, size), and its state, when nothing
    accelerates.
    """
    size = around.skeleton.size
    for added, prior in around.levels:
        own = still._replace(covs=still.covs + added)
        ahead = Ahead(pixels, rows @ own.covs[0, :size, :size] @ rows.T, own)
        yield View(parent, ahead, patches, around.false_density, prior)


def _children(levels: Iterable[View]) -> list[tuple[float, View, Indices]]:
    """Assignments of one account with a score, by more accelerations the worse they are."""
    found: list[tuple[float, View, Indices]] = []
    best, calm, whole = -np.inf, False, False
    for view in levels:
        for score, squared, patch in _assignments(view):
            found.append((score, view, patch))
            if score > best:
                best, calm = score, squared <= _CALM
                whole = not np.any((patch < 0) & (np.array(view.parent.patch) >= 0))
        if calm and whole:
            break
    return found


def _assignments(view: View) -> list[tuple[float, float, Indices]]:
    """The likely ones, each once, with its score and squared innovation (View.roughly)."""
    found: dict[tuple[int, ...], tuple[float, float, Indices]] = {}

    def add(patch: Indices) -> None:
        patch = view.with_merged(patch)
        key = tuple(patch.tolist())
        if key not in found:
            found[key] = (*view.roughly(patch), patch)

    if not len(view.patches.areas):
        add(np.full(len(view.parent.patch), -1, np.int64))
        return list(found.values())
    places, covs = view.marginal()
    # Where all have moved alike, each is within about a tenth of its own gate.
    shifted = places + _common_shift(view, places, covs)
    for start in ((places, covs), (shifted, 0.1 * covs)):
        patch = assign(view.gains(*start))
        for _ in range(_ROUNDS):
            better = assign(view.gains(*view.given(patch)))
            if np.array_equal(better, patch):
                break
            patch = better
        add(patch)
    # What an exchange leads to may be exchanged once more.
    best: tuple[int, ...] = ()
    for _ in range(2):
        now = max(found, key=lambda key: found[key][0])
        if now == best:
            break
        best = now
        for patch in _exchanges(view, found[best][2]):
            add(patch)
    return list(found.values())


def _common_shift(view: View, places: Array, covs: Array) -> Array:
    """The shift (2,) that brings most dots to patches."""
    spreads = 0.5 * (covs[:, 0, 0] + covs[:, 1, 1])
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


def _exchanges(view: View, patch: Indices) -> list[Indices]:
    """Assignments that differ by one exchange, that cost little."""
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
    likely = sorted(
        (move for move in moves if move[0] > -_EXCHANGE_NATS), key=lambda move: -move[0]
    )
    result = []
    for _, changes in likely[:_MAX_EXCHANGES]:
        changed = patch.copy()
        for dot, to in changes:
            changed[dot] = to
        result.append(changed)
    return result
