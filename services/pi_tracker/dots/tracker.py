"""Dots of one colour on a hand, told apart: patches of a picture in, named dots out.

Identity at the start comes from seeds, which are given points, or from the constellation (start.py,
constellation.py), afterwards from the hand whose dots they are: its posture is followed
(skeleton.py, motion.py). Several accounts are kept side by side (hypothesis.py), from several
postures that the first picture allows (posture.py); what is told is the likeliest one's, so that a
mix-up is undone as soon as the next pictures speak against it. A hand that all of them have lost is
found again as it was known (anew.py). Pure: time is an argument.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.body.body import Body
from services.pi_tracker.dots.body.cloud import Cloud
from services.pi_tracker.dots.body.skeleton import Skeleton
from services.pi_tracker.dots.chains import Chains, chains_of
from services.pi_tracker.dots.dot import Dot, Patch
from services.pi_tracker.dots.evidence import Begun
from services.pi_tracker.dots.extend import searched
from services.pi_tracker.dots.hypothesis import (
    AREA_NOISE,
    FEWEST_FALSE,
    HIDDEN,
    Hypothesis,
    Patches,
    Surroundings,
    Way,
    rescored,
)
from services.pi_tracker.dots.search import LIVE, Search
from services.pi_tracker.dots.start.anew import LastKnown
from services.pi_tracker.dots.start.posture import postures
from services.pi_tracker.dots.start.start import Start, from_seeds, from_shape

Array = npt.NDArray[np.float64]

# Of the number of false patches: weight of a new picture.
_FALSE_WEIGHT = 0.05
# At the start no dot is known better than to this share of the root of its area.
_WANDER = 0.15
# How large a dot is as a whole is its largest area lately; forgotten by this share a picture.
_SHRINKS = 0.995
# And this quantile of all dots' is what one has that shows as a whole: half of them may face aside
# all the time. (A fist of 8 dots of which the thumb's do, the tuning half of
# benchmarks/dots_pictures.py: with the median 71 % right, the index finger's cut into two to four;
# 95 % so.)
_LARGER = 0.75
# What is left of a patch's quality where several dots share it.
MERGED_QUALITY = 0.3


class DotTracker:
    """Follows the dots of one colour.

    landmarks name them (rhot.hand.JOINTS); seeds are points of the first picture by landmark, px:
    a landmark without one has no dot. Without any seed, tracking starts with the first picture that
    shows as many dots as there are landmarks, or as some fingers of four have.
    """

    def __init__(
        self,
        landmarks: Sequence[str],
        size_px: tuple[int, int],
        seeds: Mapping[str, tuple[float, float]] | None = None,
        search: Search = LIVE,
        *,
        remembers: bool = False,
    ) -> None:
        """size_px is the picture's. remembers keeps the way(), which grows with each picture.

        Raises ValueError on a landmark that no hand has.
        """
        self._search, self._remembers = search, remembers
        self.landmarks = tuple(landmarks)
        self._size_px = size_px
        self._seeds = dict(seeds or {})
        unknown = sorted(set(self._seeds) - set(self.landmarks))
        if unknown:
            raise ValueError(
                f"seed {unknown[0]!r} is none of the dots; they are {', '.join(self.landmarks)}"
            )
        # Of the dots that there are, once tracking has started.
        self._chains: Chains = chains_of(self.landmarks)
        self._body: Body
        self._hypotheses: list[Hypothesis] = []
        self._false_patches = 0.0
        self._time_s = 0.0
        # (n,) px^2: how large each dot is when all of it shows.
        self._whole: Array = np.zeros(0)
        self._known = LastKnown()
        # How likely the last picture was to the likeliest account, and all but the first; how far
        # that is from showing a hand; nats.
        self.gained = self.nats = self.misfit = 0.0
        # The hand in the picture with which tracking started, None before.
        self.begun: Begun | None = None
        # What a person should know of the start; empty if all is well.
        self.notes: list[str] = []

    def step(self, patches: Sequence[Patch], time_s: float) -> dict[str, Dot]:
        """The dots of the next picture, by landmark; empty until tracking has started."""
        if not self._hypotheses:
            self._start(patches, time_s)
            return self._dots(patches) if self._hypotheses else {}
        elapsed_s = motion.between(self._time_s, time_s)
        self._time_s = time_s
        arrays = arrays_of(patches)
        around = self._around(elapsed_s)
        parents, search = self._hypotheses, self._search
        found = searched(parents, arrays, around, elapsed_s, search)
        found = self._known.against(found, parents[0], arrays, around, elapsed_s, search)
        self.gained = max(one.score for one in found)
        self.nats += self.gained
        self._hypotheses = rescored(found)
        best = self._hypotheses[0]
        self._whole = _grown(self._whole, best.patch, arrays.areas)
        self._known.note(best, arrays.areas, self._whole)
        false = len(patches) - len({p for p in best.patch if p >= 0})
        self._false_patches += _FALSE_WEIGHT * (false - self._false_patches)
        return self._dots(patches)

    @property
    def names(self) -> tuple[str, ...]:
        """The landmarks that have a dot, in the order of a way's patches."""
        return self._chains.landmarks

    @property
    def is_cloud(self) -> bool:
        """Whether dots hang on no hand."""
        return self._search.cloud

    def way(self) -> list[Way]:
        """What the account that is the likeliest by now said of each picture since the start.

        Empty before, and where nothing is remembered.
        """
        found: list[Way] = []
        way = self._hypotheses[0].way if self._hypotheses else None
        while way is not None:
            found.append(way)
            way = way.before
        return found[::-1]

    @property
    def dot_area_px2(self) -> float:
        """How large a dot is that shows as a whole, 0 while it is unknown."""
        return float(np.quantile(self._whole, _LARGER)) if self._hypotheses else 0.0

    def _start(self, patches: Sequence[Patch], time_s: float) -> None:
        if self._seeds:
            found = from_seeds(self._chains, self._seeds, patches)
        else:
            found = from_shape(self._chains, patches)
        if found is not None:
            self._begin(found, patches, time_s)

    def _begin(self, found: Start, patches: Sequence[Patch], time_s: float) -> None:
        self._chains, self.notes, self._time_s = found.chains, found.notes, time_s
        areas = np.array([p.area_px for p in patches]) if patches else np.array([100.0])
        typical = float(np.median(areas))
        own = [typical if p < 0 else patches[p].area_px for p in found.patch]
        self._whole = np.array(own)
        missing = np.array([p < 0 for p in found.patch], np.int64)
        places = arrays_of(patches).places
        false = np.delete(places, [p for p in found.patch if p >= 0], axis=0)
        way = Way(None, found.patch) if self._remembers else None
        sigmas = np.maximum(found.sigmas, _WANDER * np.sqrt(typical))
        self._body, begun = self._first(found, sigmas)
        scores, states = zip(*begun, strict=True)
        self.begun = Begun(
            self._body, motion.together(list(states)), np.array(scores), self._size_px
        )
        self._hypotheses = [
            Hypothesis(
                score, state, branch, np.array(own), missing, found.patch, found.patch, false, way
            )
            for branch, (score, state) in enumerate(zip(scores, states, strict=True))
        ]

    def _first(self, found: Start, sigmas: Array) -> tuple[Body, list[tuple[float, motion.State]]]:
        """What the dots hang on, its states in the first picture and their scores."""
        if self._search.cloud:
            cloud = Cloud(found.places, self._size_px)
            return cloud, [(0.0, cloud.begun(sigmas))]
        hand = Skeleton(found.chains.landmarks, self._size_px)
        self.misfit, begun = postures(hand, found.places, sigmas)
        return hand, begun

    def _around(self, elapsed_s: float) -> Surroundings:
        width, height = self._size_px
        density = (self._false_patches + FEWEST_FALSE) / (width * height)
        return Surroundings(self._body, motion.levels(self._body, elapsed_s), density)

    def _dots(self, patches: Sequence[Patch]) -> dict[str, Dot]:
        best = self._hypotheses[0]
        weights = np.exp([one.score for one in self._hypotheses])
        weights /= weights.sum()
        places, sigmas = self._expected(best)
        dots: dict[str, Dot] = {}
        for number, name in enumerate(self._chains.landmarks):
            index = best.patch[number]
            x, y = places[number].tolist()
            if index < 0:
                area = float(best.areas[number])
                dots[name] = Dot(x, y, float(sigmas[number]), 0.0, "carried", area, -1)
                continue
            agree = sum(
                float(weight)
                for weight, one in zip(weights, self._hypotheses, strict=True)
                if one.patch[number] == index
            )
            dots[name] = _seen(best, number, patches, agree, (x, y), float(sigmas[number]))
        return dots

    def _expected(self, best: Hypothesis) -> tuple[Array, Array]:
        """Where the hand has its dots (n, 2), and their sigmas (n,), px."""
        state = best.state
        pixels, slopes = self._body.project(*state[:4])
        size = self._body.size
        covs = slopes[0] @ state.covs[0, :size, :size] @ slopes[0].swapaxes(1, 2)
        return pixels[0], np.sqrt(0.5 * np.trace(covs, axis1=1, axis2=2))


def _grown(whole: Array, told: Sequence[int], areas: Array) -> Array:
    """How large dots are as a whole (n,) after a picture in which `told` are their patches."""
    grown = _SHRINKS * whole
    for dot, patch in enumerate(told):
        if patch >= 0 and told.count(patch) == 1:
            grown[dot] = max(grown[dot], float(areas[patch]))
    return grown


def _seen(
    best: Hypothesis,
    number: int,
    patches: Sequence[Patch],
    agree: float,
    expected_px: tuple[float, float],
    sigma_px: float,
) -> Dot:
    index = best.patch[number]
    patch = patches[index]
    if best.patch.count(index) > 1:
        x, y = expected_px
        return Dot(
            x, y, sigma_px, MERGED_QUALITY * agree * patch.quality, "merged", patch.area_px, index
        )
    return seen_alone(best.patch, index, patches, float(best.areas[number]), agree)


def seen_alone(
    told: Sequence[int], index: int, patches: Sequence[Patch], area_px: float, agree: float
) -> Dot:
    """The dot of a patch that no other dot shares.

    told are all dots' patches, area_px is how large this dot is as a rule, agree the probability
    that it is this one.
    """
    patch = patches[index]
    parts = {k for k, one in enumerate(patches) if one.whole == patch.whole and patch.whole >= 0}
    # A part of which the others are nobody's is no part.
    x, y = patch.whole_px if len(parts & set(told)) == 1 else (patch.x_px, patch.y_px)
    # Hidden in part, its centre has moved, where to nobody knows.
    hidden = max(0.0, 1.0 - patch.area_px / max(area_px, 1.0))
    offset = HIDDEN * hidden * float(np.sqrt(area_px)) if hidden > AREA_NOISE else 0.0
    sigma = float(np.hypot(patch.sigma_px, offset))
    return Dot(x, y, sigma, patch.quality * agree, "seen", patch.area_px, index)


def arrays_of(patches: Sequence[Patch]) -> Patches:
    """The same patches as arrays."""
    count = len(patches)
    return Patches(
        np.array([(p.x_px, p.y_px) for p in patches]).reshape(count, 2),
        np.maximum(np.array([p.area_px for p in patches]), 1.0),
        np.array([p.sigma_px for p in patches]),
        np.array([p.whole for p in patches], np.int64),
        np.array([p.whole_px for p in patches]).reshape(count, 2),
    )
