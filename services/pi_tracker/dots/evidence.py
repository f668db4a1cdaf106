"""How likely all pictures of a recording are if their dots are called so. Pure.

A search follows a few postures for each way to name the dots, and gives up what is unlikely for a
moment. What it says of its own account is that of the posture it has kept, which may be hundreds of
nats less likely than another with the same names: wrong names were preferred to right ones. Here
names are given, so that many postures and accelerations are followed, and accounts compared alike.
How large each dot is, each account learns for itself: sizes that came from an account of all
pictures held it for right where it had exchanged a large dot and a small one for a third of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.body.body import Body
from services.pi_tracker.dots.hypothesis import FEWEST_FALSE, Known, Patches, View

Array = npt.NDArray[np.float64]
Told = tuple[int, ...]

# States that are followed, so many of one posture of the start, and none that is so much (nats)
# less likely than the best. (Of what 48 states of any posture say of `grab`, seed 2, 1 state of
# each posture misses 150 nats, 4 miss 5. Of seeds 8, 13 and 20, 4 and 2 mistake seed 13.)
_KEPT, _ALIKE, _WORSE_NATS = 8, 3, 16.0
# A dot's area is a mean over so many pictures, of which none counts for more than so much of its
# logarithm: hidden dots are small. (A fist of 15 dots, seed 7 of the tuning half of
# benchmarks/dots_pictures.py, of which the right names are found but were less likely by 116 nats:
# they are more likely by 200 to 300 with 20, 60 and 200 pictures.)
_PICTURES, _STEP = 60, 0.5


class Begun(NamedTuple):
    """The hand's states in the first picture, and their scores (nats)."""

    body: Body
    states: motion.State
    scores: Array
    size_px: tuple[int, int]  # the picture's


class Trace(NamedTuple):
    """What is known after a picture, if dots were called so until then."""

    states: motion.State
    scores: Array  # (k,) nats of all pictures so far
    branch: npt.NDArray[np.int64]  # (k,) which of the postures at the start each came from
    areas: Array  # (n,) px^2 of each dot where its patch was its own
    looks: npt.NDArray[np.int64]  # (n,) in so many pictures, _PICTURES at most
    unseen: npt.NDArray[np.int64]  # (n,) pictures in a row in which each dot was not seen
    false: Array  # (f, 2) patches of the last picture that are no dots

    @property
    def nats(self) -> float:
        """Log likelihood of all pictures so far."""
        return float(self.scores.max())


class Judge:
    """Follows accounts of the pictures of a recording; all by the same measure."""

    def __init__(
        self,
        begun: Begun,
        pictures: Sequence[Patches],
        times_s: Sequence[float],
        told: Sequence[Told],
    ) -> None:
        """told is an account of all, if a rough one: it says how many patches are no dots."""
        self._begun, self.pictures, self.times_s = begun, pictures, times_s
        false = [len(p.areas) - len(set(own) - {-1}) for p, own in zip(pictures, told, strict=True)]
        width, height = begun.size_px
        # Patches that are no dots, per px^2.
        self.false_density = (float(np.mean(false)) + FEWEST_FALSE) / (width * height)

    @property
    def body(self) -> Body:
        """The hand whose dots they are."""
        return self._begun.body

    def backwards(self, last: Trace) -> Judge:
        """The same of the pictures from the last to the first; `last` is a trace after the last."""
        states = motion.reversed_in_time(self.body, last.states)
        turned = copy(self)
        turned._begun = self._begun._replace(states=states, scores=last.scores - last.nats)
        turned.pictures = self.pictures[::-1]
        turned.times_s = [-time_s for time_s in self.times_s[::-1]]
        return turned

    def retraced(self, told: Sequence[Told]) -> Iterator[Trace]:
        """What is known after each picture of an account of all."""
        trace = self.begin(told[0])
        yield trace
        for number in range(1, len(told)):
            trace = self.follow(trace, number, told[number])
            yield trace

    def begin(self, told: Told) -> Trace:
        """After the first picture."""
        begun, patch, patches = self._begun, np.array(told), self.pictures[0]
        alone = _alone(patch)
        # Dots that are not seen as all others are; without any, as a small one.
        areas = np.full(
            len(patch), np.median(patches.areas[patch[alone]]) if alone.any() else 100.0
        )
        areas[alone] = patches.areas[patch[alone]]
        return Trace(
            begun.states,
            begun.scores,
            np.arange(len(begun.scores)),
            areas,
            alone.astype(np.int64),
            (patch < 0).astype(np.int64),
            np.delete(patches.places, patch[patch >= 0], axis=0),
        )

    def follow(self, before: Trace, number: int, told: Told) -> Trace:
        """After picture `number`, of which `told` has dots' patches; before is that before it."""
        patches, patch = self.pictures[number], np.array(told)
        known = Known(0.0, before.areas, before.unseen, before.false)
        elapsed_s = motion.between(self.times_s[number - 1], self.times_s[number])
        likeliest = before.states.take([int(before.scores.argmax())])
        ahead = motion.coasted(self.body, likeliest, elapsed_s)
        view = View(known, patches, self.false_density, self.body.showing(*ahead[:4])[0])
        parent, states, scores = _followed(self.body, before, view, patch, elapsed_s)
        scores, branch = scores + view.claims(patch), before.branch[parent]
        rows = _best(scores, branch)
        return Trace(
            states.take(rows),
            scores[rows],
            branch[rows],
            *_learned_areas(before, patches, patch),
            np.where(patch < 0, before.unseen + 1, 0),
            np.delete(patches.places, patch[patch >= 0], axis=0),
        )


def _followed(
    body: Body, before: Trace, view: View, patch: npt.NDArray[np.int64], elapsed_s: float
) -> tuple[npt.NDArray[np.int64], motion.State, Array]:
    """Each state with each acceleration: what it came from, what it is and its score."""
    ways = motion.levels(body, elapsed_s)
    parent, level = (part.ravel() for part in np.mgrid[: len(before.scores), : len(ways)])
    ahead = motion.coasted(body, before.states, elapsed_s).take(parent.tolist())
    ahead = ahead._replace(covs=ahead.covs + np.array([cov for cov, _ in ways])[level])
    seen, places, variances = view.measured(patch)
    count = len(parent)
    after = motion.updated(
        body,
        ahead,
        np.tile(seen, (count, 1)),
        np.tile(places, (count, 1, 1)),
        np.tile(variances, (count, 1)),
    )
    priors = np.array([prior for _, prior in ways])[level]
    return parent, after.state, before.scores[parent] + after.nats + priors


def _best(scores: Array, branch: npt.NDArray[np.int64]) -> list[int]:
    """Rows that are kept, the best first."""
    rows: list[int] = []
    for row in np.argsort(-scores).tolist():
        if len(rows) >= _KEPT or scores[row] < scores.max() - _WORSE_NATS:
            break
        if np.count_nonzero(branch[rows] == branch[row]) < _ALIKE:
            rows.append(row)
    return rows


def _alone(patch: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Which dots have a patch (n,) of their own, -1 of none."""
    return (patch >= 0) & (np.count_nonzero(patch[:, None] == patch[None], axis=1) == 1)


def _learned_areas(
    before: Trace, patches: Patches, patch: npt.NDArray[np.int64]
) -> tuple[Array, npt.NDArray[np.int64]]:
    """The areas of dots and their looks after one more picture, whose patches (n,) they have."""
    alone, areas, looks = _alone(patch), before.areas.copy(), before.looks.copy()
    looks[alone] = np.minimum(looks[alone] + 1, _PICTURES)
    off = np.log(patches.areas[patch[alone]] / areas[alone])
    areas[alone] *= np.exp(np.clip(off, -_STEP, _STEP) / looks[alone])
    return areas, looks
