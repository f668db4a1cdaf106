"""Which dot is which as tracking starts: from given points, or from the constellation. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rhot.hand import DIGITS
from services.pi_tracker.dots.assignment import assign
from services.pi_tracker.dots.chains import Chains, chains_of, finger_landmarks
from services.pi_tracker.dots.dot import Patch
from services.pi_tracker.dots.start.constellation import guess, likely_fingers

Array = npt.NDArray[np.float64]

# A seed means the patch that is within so many of its diameters, or else none.
_SEED_DIAMETERS = 2.0
# A guess that is likelier than any other by less than this may be wrong. (Of 80 pictures of thumb
# and index finger of real hands from any side one was guessed wrong, by .5 nats.)
_SURE_NATS = 0.6
# Without seeds no dot is smaller than this share of the median patch.
_SPECK = 0.3


@dataclass(frozen=True, eq=False)
class Start:
    """Dots as tracking starts: their patches (-1 for none), places (n, 2) and sigmas (n,)."""

    chains: Chains
    patch: tuple[int, ...]
    places: Array
    sigmas: Array
    notes: list[str] = field(default_factory=list)


def from_seeds(
    chains: Chains, seeds: Mapping[str, tuple[float, float]], patches: Sequence[Patch]
) -> Start | None:
    """Each seeded dot has the patch at its seed, all seeds at once; None without a patch.

    A seed without a patch starts there all the same, unsure. Landmarks without a seed have no dot.
    """
    if not patches:
        return None
    names = [name for name in chains.landmarks if name in seeds]
    own = chains_of(names)
    points = np.array([seeds[name] for name in names])
    places = np.array([(p.x_px, p.y_px) for p in patches])
    diameters = np.sqrt(4.0 / np.pi * np.array([p.area_px for p in patches]))
    apart = np.linalg.norm(places[None] - points[:, None], axis=2)
    reach = _SEED_DIAMETERS * np.maximum(diameters, 4.0)[None]
    # The sum of distances is least where the sum of what is left of a reach is largest.
    patch = assign(np.where(apart < reach, 1e3 + reach - apart, -np.inf))
    found = patch >= 0
    starts = np.where(found[:, None], places[patch], points)
    typical = float(np.median(diameters))
    sigmas = np.where(found, 0.1 * typical, typical)
    notes = [
        f"there is no dot at the seed of {name.replace('_', ' ')} "
        f"({points[k][0]:g}, {points[k][1]:g}): it is searched from there on"
        for k, name in enumerate(names)
        if not found[k]
    ]
    return Start(own, tuple(patch.tolist()), starts, sigmas, notes)


def from_shape(chains: Chains, patches: Sequence[Patch]) -> Start | None:
    """Names by the constellation; None while there are fewer dots than names.

    Of all five fingers, those that so many dots are most likely on; more patches than dots are
    false ones.
    """
    sizes = np.array([p.area_px for p in patches])
    # A speck is no dot, and would make nine of eight.
    large = np.flatnonzero(sizes >= _SPECK * np.median(sizes)) if len(sizes) else sizes.astype(int)
    places = np.array([(patches[k].x_px, patches[k].y_px) for k in large]).reshape(-1, 2)
    count = len(chains.landmarks)
    if len(places) < count and set(finger_joints(DIGITS)) == set(chains.landmarks):
        wanted = set(finger_joints(likely_fingers(len(places))))
        if not wanted:
            return None
        chains = chains_of([name for name in chains.landmarks if name in wanted])
    found = guess(chains, places)
    if found is None:
        return None
    starts = places[list(found.patch)]
    own = large[list(found.patch)]
    areas = sizes[own]
    sigmas = 0.1 * np.sqrt(4.0 / np.pi * areas)
    notes = []
    if found.margin < _SURE_NATS:
        notes.append(
            "the dots could be named in another way as well: see whether they are right, or start "
            "with fingers apart and straight, or give the dots' places (`rhot track --seed`)"
        )
    return Start(chains, tuple(own.tolist()), starts, sigmas, notes)


def finger_joints(fingers: Sequence[str]) -> list[str]:
    """The four joints of each of the fingers."""
    return [name for finger in fingers for name in finger_landmarks(finger)]
