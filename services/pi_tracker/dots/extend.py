"""The likely assignments of a picture's patches to the dots of several accounts. Pure.

A beam search: dot by dot, the one that is known best first, each gets every patch that it may have,
and what is left learns from it where its own dots are. So a hand that jerks or closes is found once
a few of its dots are, and the score of a partial assignment is exact where postures are linear.
Partial assignments are compared by their score and the best that is left for their other dots. All
accounts, and all accelerations that a hand may have had, are searched together. The likeliest are
then updated exactly.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.hypothesis import (
    Hypothesis,
    Patches,
    Surroundings,
    View,
    pruned,
    rescored,
)
from services.pi_tracker.dots.search import LIVE, Search

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# Of partial assignments none is kept that is so much worse than the best (nats): a first guess.
_WORSE_NATS = 16.0


class _Tables(NamedTuple):
    """What p views say of n dots and m patches, nats; places (m, 2)."""

    found: Array  # (p, n, m): of a patch of its own
    shared: Array  # (p, n): of one that another dot has
    variances: Array  # (p, n, m)
    more: Array  # (p, n): what a patch that is shared adds to its variance
    places: Array


class _Beam(NamedTuple):
    """k partial assignments: of which view and acceleration, and where dots are expected now."""

    view: Indices  # (k,)
    level: Indices  # (k,)
    score: Array  # (k,)
    places: Array  # (k, n, 2)
    covs: Array  # (k, n, 2, n, 2)
    patch: Indices  # (k, n), -1 of none
    taken: npt.NDArray[np.bool_]  # (k, m)

    def take(self, rows: Indices) -> _Beam:
        """Some of them."""
        return _Beam(
            self.view[rows],
            self.level[rows],
            self.score[rows],
            self.places[rows],
            self.covs[rows],
            self.patch[rows],
            self.taken[rows],
        )


def searched_on(
    hypotheses: list[Hypothesis],
    patches: Patches,
    around: Surroundings,
    elapsed_s: float,
    search: Search = LIVE,
) -> list[Hypothesis]:
    """What is kept of hypotheses after the next picture: at least one, the best first with score 0.

    Of postures that are searched apart (search.apart_nats) each has a beam of its own.
    """
    return rescored(searched(hypotheses, patches, around, elapsed_s, search))


def searched(
    hypotheses: list[Hypothesis],
    patches: Patches,
    around: Surroundings,
    elapsed_s: float,
    search: Search,
) -> list[Hypothesis]:
    """The same, in no order; scores go on from those before."""
    if search.apart_nats <= 0.0:
        return pruned(extend(hypotheses, patches, around, elapsed_s, search), search)
    found: list[Hypothesis] = []
    for branch in {one.branch for one in hypotheses}:
        own = [one for one in hypotheses if one.branch == branch]
        found += pruned(extend(own, patches, around, elapsed_s, search), search)
    least = max(one.score for one in found) - search.apart_nats
    return [one for one in found if one.score > least]


def extend(
    parents: list[Hypothesis],
    patches: Patches,
    around: Surroundings,
    elapsed_s: float,
    search: Search = LIVE,
) -> list[Hypothesis]:
    """What hypotheses may become, the likely ones, in no order; at least one."""
    body = around.body
    still = motion.coasted(body, motion.together([p.state for p in parents]), elapsed_s)
    showing = body.showing(*still[:4])
    views = [
        View(parent, patches, around.false_density, shows)
        for parent, shows in zip(parents, showing, strict=True)
    ]
    beam = _searched(_begun(views, still, around), _tables(views, patches), search)
    before = still.take(beam.view.tolist())
    added = np.array([cov for cov, _ in around.levels])
    before = before._replace(covs=before.covs + added[beam.level])
    own = [views[k] for k in beam.view.tolist()]
    measured = zip(*(v.measured(p) for v, p in zip(own, beam.patch, strict=True)), strict=True)
    seen, places, variances = (np.array(part) for part in measured)
    after = motion.updated(body, before, seen, places, variances)
    nats = after.nats + np.array([prior for _, prior in around.levels])[beam.level]
    return [
        own[k].become(parents[row], beam.patch[k], after.state.take([k]), float(nats[k]))
        for k, row in enumerate(beam.view.tolist())
    ]


def _begun(views: list[View], still: motion.State, around: Surroundings) -> _Beam:
    """Every account with every acceleration, without any patch yet."""
    body, levels = around.body, around.levels
    pixels, slopes = body.project(*still[:4])
    count, dots, size = len(pixels), pixels.shape[1], body.size
    rows = slopes.reshape(count, 1, 2 * dots, size)
    added = np.array([cov[:size, :size] for cov, _ in levels])
    covs = rows @ (still.covs[:, None, :size, :size] + added) @ rows.swapaxes(2, 3)
    each, level = (part.ravel() for part in np.mgrid[:count, : len(levels)])
    nothing = np.array([view.claims(np.full(dots, -1)) for view in views])
    priors = np.array([prior for _, prior in levels])
    return _Beam(
        each,
        level,
        nothing[each] + priors[level],
        pixels[each],
        covs.reshape(-1, dots, 2, dots, 2),
        np.full((len(each), dots), -1),
        np.zeros((len(each), len(views[0].patches.areas)), bool),
    )


def _tables(views: list[View], patches: Patches) -> _Tables:
    return _Tables(
        np.array([view.alone() for view in views]),
        np.array([view.beside() for view in views]),
        np.array([view.variances for view in views]),
        np.array([view.sharing for view in views]),
        patches.places,
    )


def _searched(beam: _Beam, tables: _Tables, search: Search) -> _Beam:
    """The likely whole assignments, the likeliest first; of each account each once."""
    dots = beam.patch.shape[1]
    left = np.ones(dots, bool)
    while left.any():
        gains = _gains(beam, tables, left)
        # What the others gain at best.
        rest = np.maximum(gains.max(axis=2, initial=0.0), 0.0)
        bounds = beam.score + rest.sum(axis=1)
        likely = _likely(bounds, search.beam)
        beam, gains, rest, bounds = beam.take(likely), gains[likely], rest[likely], bounds[likely]
        spread = np.einsum("iaia->i", beam.covs[0])
        dot = int(np.where(left, spread, np.inf).argmin())
        own = _options(beam, tables, gains[:, np.cumsum(left)[dot] - 1], dot)
        totals = own + (bounds - rest[:, np.cumsum(left)[dot] - 1])[:, None]
        chosen = _likely(totals.ravel(), 2 * search.beam)
        which, patch = np.divmod(chosen, own.shape[1])
        left[dot] = False
        beam = _given(beam.take(which), tables, dot, patch - 1, own[which, patch])
    order = np.argsort(-beam.score, kind="stable")
    beam = beam.take(order[beam.score[order] > beam.score[order[0]] - _WORSE_NATS])
    level = beam.level * search.each_acceleration
    which = np.concatenate([beam.view[:, None], level[:, None], beam.patch], axis=1)
    _, first = np.unique(which, axis=0, return_index=True)
    return beam.take(np.sort(first)[: search.updated])


def _likely(scores: Array, count: int) -> Indices:
    """The rows of the best, and of none that is much worse."""
    if len(scores) > count:
        rows = np.argpartition(-scores, count)[:count]
    else:
        rows = np.arange(len(scores))
    rows = rows[scores[rows] > scores.max() - _WORSE_NATS]
    return np.asarray(rows[np.argsort(-scores[rows], kind="stable")])


def _density(away: Array, xx: Array, xy: Array, yy: Array) -> Array:
    """Log density of offsets (..., 2) with covariances."""
    det = xx * yy - xy**2
    x, y = away[..., 0], away[..., 1]
    squares = (yy * x**2 - 2.0 * xy * x * y + xx * y**2) / det
    return np.asarray(-0.5 * (squares + np.log(det)) - np.log(2.0 * np.pi))


def _gains(beam: _Beam, tables: _Tables, left: npt.NDArray[np.bool_]) -> Array:
    """What each dot that is left gains by each patch that is free over being missing (k, l, m)."""
    dots = np.flatnonzero(left)
    own = beam.covs[:, dots, :, dots, :]  # (l, k, 2, 2)
    extra = tables.variances[:, dots][beam.view]
    xx = own[:, :, 0, 0].T[..., None] + extra
    yy = own[:, :, 1, 1].T[..., None] + extra
    xy = own[:, :, 0, 1].T[..., None]
    away = tables.places - beam.places[:, dots, None]
    gains = _density(away, xx, xy, yy) + tables.found[:, dots][beam.view]
    return np.where(beam.taken[:, None], -np.inf, gains)


def _options(beam: _Beam, tables: _Tables, free: Array, dot: int) -> Array:
    """What a dot gains by none (k, 1 + m: the first, 0), and by each patch, free or shared."""
    own = beam.covs[:, dot, :, dot]
    extra = tables.variances[:, dot][beam.view] + tables.more[beam.view, dot][:, None]
    away = tables.places - beam.places[:, dot, None]
    density = _density(away, own[:, :1, 0] + extra, own[:, :1, 1], own[:, 1:, 1] + extra)
    shared = density + tables.shared[beam.view, dot][:, None]
    return np.concatenate([np.zeros((len(own), 1)), np.where(beam.taken, shared, free)], axis=1)


def _given(beam: _Beam, tables: _Tables, dot: int, patch: Indices, gain: Array) -> _Beam:
    """What follows from a dot's patches (k,) for the others."""
    seen = patch >= 0
    each = np.arange(len(patch))
    count = beam.patch.shape[1]
    beam.patch[:, dot] = patch
    if not seen.any():
        return beam._replace(score=beam.score + gain)
    variance = tables.variances[beam.view, dot, patch]
    variance = variance + np.where(beam.taken[each, patch], tables.more[beam.view, dot], 0.0)
    cross = beam.covs[:, :, :, dot].reshape(len(patch), 2 * count, 2)
    cov = beam.covs[:, dot, :, dot] + variance[:, None, None] * np.eye(2)
    gains = cross @ np.linalg.inv(cov) * seen[:, None, None]
    away = (tables.places[patch] - beam.places[:, dot])[..., None]
    places = beam.places + (gains @ away).reshape(beam.places.shape)
    covs = beam.covs - (gains @ cross.swapaxes(1, 2)).reshape(beam.covs.shape)
    beam.taken[each[seen], patch[seen]] = True
    return beam._replace(score=beam.score + gain, places=places, covs=covs)
