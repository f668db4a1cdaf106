"""Which dot is which without seeds: chains of dots with the proportions of fingers, side by side.

Pure. Each finger takes the chains of patches whose bones are in proportion and bend to one side;
fingers are then put together so that their roots lie as far apart as knuckles do, in their order.
Foreshortening is unknown, so this is a guess with a margin: how much likelier it is than the second
best. A hand whose fingers are spread and straight is told best.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.hand import DIGITS
from services.pi_tracker.dots.chains import Chains

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# Foreshortening differs between the bones of a finger by so much, between fingers by so much
# (sigma of logarithms); consecutive bones turn by about so much (rad).
_BONE_SIGMA, _FINGER_SIGMA, _TURN_SIGMA = 0.3, 0.35, 0.7
# Neighbouring fingers point into directions that differ by about so much (rad).
_SPREAD_SIGMA = 0.7
# Knuckles further apart than the hand's scale allows, as a share (sigma); and the least that they
# are apart, of what they are in a hand seen from its back.
_KNUCKLE_SIGMA, _CLOSEST = 0.2, 0.3
# Knuckles lie ahead of the thumb's root, seen along the fingers: nats for lying behind.
_BEHIND_NATS = 3.0
# Nearest patches that may be the next on a chain, chains kept for each finger, and partial hands.
_NEXT, _CHAINS, _HANDS = 6, 80, 200


class Guess(NamedTuple):
    """The patch of each landmark (n,), and by how many nats it is likelier than the next best."""

    patch: tuple[int, ...]
    margin: float


class _Chain(NamedTuple):
    """Patches of one finger from root to tip."""

    patch: tuple[int, ...]
    nats: float
    log_scale: float  # of px per m
    direction: Array  # (2,) unit vector from root to tip


class _Hand(NamedTuple):
    """Chains of the first fingers."""

    chains: tuple[_Chain, ...]
    nats: float


def guess(chains: Chains, places: Array) -> Guess | None:
    """The likeliest names of patches at places (m, 2); None with fewer patches than dots.

    Only for landmarks on fingers: palm and wrist need seeds.
    """
    if len(places) < len(chains.landmarks) or (chains.digits < 0).any():
        return None
    rows = sorted(set(chains.digits.tolist()))
    fingers = [np.flatnonzero(chains.digits == row) for row in rows]
    fingers = [_in_order(chains, own) for own in fingers]
    options = [_finger_chains(chains, own, places) for own in fingers]
    hands = [_Hand((), 0.0)]
    for number, likely in enumerate(options):
        grown = [
            _Hand((*hand.chains, chain), hand.nats + nats)
            for hand in hands
            for chain in likely
            if not any(set(chain.patch) & set(other.patch) for other in hand.chains)
            for nats in [chain.nats + _beside(chains, fingers, number, hand, chain, places)]
        ]
        hands = sorted(grown, key=lambda hand: hand.nats)[:_HANDS]
    if not hands:
        return None
    best = hands[0]
    patch = np.full(len(chains.landmarks), -1, np.int64)
    for own, chain in zip(fingers, best.chains, strict=True):
        patch[own] = chain.patch
    margin = hands[1].nats - best.nats if len(hands) > 1 else float("inf")
    return Guess(tuple(patch.tolist()), margin)


def likely_fingers(count: int) -> tuple[str, ...]:
    """The fingers whose joints `count` dots are most likely on, four each; () if none fit."""
    usual = {4: ("index",), 8: DIGITS[:2], 12: DIGITS[:3], 16: DIGITS[1:], 20: DIGITS}
    return usual.get(count, ())


def _in_order(chains: Chains, own: Indices) -> Indices:
    """Landmarks of one finger from root to tip."""
    nearer = {int(far): int(near) for near, far in chains.bones}
    depth = []
    for landmark in own.tolist():
        steps, at = 0, landmark
        while at in nearer:
            steps, at = steps + 1, nearer[at]
        depth.append(steps)
    return own[np.argsort(depth)]


def _finger_chains(chains: Chains, own: Indices, places: Array) -> list[_Chain]:
    """The likeliest chains of patches for a finger, the likeliest first."""
    far = {int(child): number for number, (_, child) in enumerate(chains.bones)}
    lengths = np.array([chains.lengths_m[far[int(landmark)]] for landmark in own[1:]])
    apart = np.linalg.norm(places[None] - places[:, None], axis=2)
    near = np.argsort(apart, axis=1)[:, 1 : 1 + _NEXT]
    paths: list[tuple[int, ...]] = [(k,) for k in range(len(places))]
    for _ in lengths:
        paths = [(*path, int(k)) for path in paths for k in near[path[-1]] if k not in path]
    if not paths:
        return []
    found = [_judged(path, places, lengths) for path in paths]
    return sorted(found, key=lambda chain: chain.nats)[:_CHAINS]


def _judged(path: tuple[int, ...], places: Array, lengths: Array) -> _Chain:
    points = places[list(path)]
    if len(path) == 1:
        return _Chain(path, 0.0, 0.0, np.zeros(2))
    bones = np.diff(points, axis=0)
    sizes = np.maximum(np.hypot(bones[:, 0], bones[:, 1]), 1.0)
    scales = np.log(sizes / lengths)
    nats = 0.5 * float(np.sum((scales - scales.mean()) ** 2)) / _BONE_SIGMA**2
    turns = np.array([np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b) for a, b in pairwise(bones)])
    nats += 0.5 * float(np.sum(turns**2)) / _TURN_SIGMA**2
    # To one side, but for what a thumb or a straight finger bends back.
    back = min(float(np.maximum(turns, 0.0).sum()), float(np.maximum(-turns, 0.0).sum()))
    nats += 0.5 * (back / 0.3) ** 2
    whole = points[-1] - points[0]
    direction = whole / max(float(np.hypot(*whole)), 1.0)
    # A foreshortened bone is shorter, never longer: the scale is that of the longest.
    return _Chain(path, nats, float(scales.max()), direction)


def _beside(
    chains: Chains,
    fingers: Sequence[Indices],
    number: int,
    hand: _Hand,
    chain: _Chain,
    places: Array,
) -> float:
    """What it costs that this chain is the next finger of a hand."""
    if not hand.chains:
        return 0.0
    last = hand.chains[-1]
    nats = 0.5 * (chain.log_scale - last.log_scale) ** 2 / _FINGER_SIGMA**2
    span = len(chains.bones) + number - 1
    scale = float(np.exp(max(one.log_scale for one in (*hand.chains, chain))))
    step = places[chain.patch[0]] - places[last.patch[0]]
    apart = float(np.hypot(*step)) / (scale * float(chains.spans_m[span]))
    nats += 0.5 * (max(apart - 1.0, _CLOSEST - apart, 0.0) / _KNUCKLE_SIGMA) ** 2
    of_thumb = chains.digits[fingers[number - 1][0]] == 0
    cosine = float(np.clip(chain.direction @ last.direction, -1.0, 1.0))
    if not of_thumb:
        nats += 0.5 * (np.arccos(cosine) / _SPREAD_SIGMA) ** 2
    else:
        forward = chain.direction + last.direction
        ahead = float(step @ forward) / max(float(np.hypot(*step) * np.hypot(*forward)), 1e-9)
        nats += _BEHIND_NATS * max(-ahead, 0.0)
    if len(hand.chains) > 1 and chains.digits[fingers[number - 2][0]] != 0:
        # Knuckles lie on a line, in order.
        before = places[last.patch[0]] - places[hand.chains[-2].patch[0]]
        line = float(before @ step) / max(float(np.hypot(*before) * np.hypot(*step)), 1e-9)
        nats += 0.5 * (np.arccos(np.clip(line, -1.0, 1.0)) / _SPREAD_SIGMA) ** 2
    return float(nats)
