"""What a hand's shape says of an assignment, without any motion: bones that are too long, fingers
that bend both ways.

Pure. A finger's joints turn about parallel axes, so it lies in a plane, and its joints bend to the
same side; that is so in any picture of it, from whichever side.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots.chains import Chains

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

# A bone longer than the longest it was by more than a share is unlikely: sigma of that, and the
# most that one bone costs in a picture.
_LENGTH_SLACK, _LENGTH_SIGMA, _LENGTH_NATS = 0.08, 0.12, 6.0
# Two joints of a finger that bend to opposite sides, each by so much (sine) or more: what it costs.
# The last joint may bend back by 31 deg in a pinch.
_BENT, _BOTH_WAYS_NATS = 0.6, 1.5


def strain(chains: Chains, places: Array, known: Mask, unsure_px: Array, lengths: Array) -> float:
    """How unlikely dots at places (n, 2) are by shape alone, nats; only `known` (n,) ones count.

    unsure_px (n,) may be missing of a distance; lengths (s,) are the longest the spans were, px.
    """
    near, far = chains.spans[:, 0], chains.spans[:, 1]
    both = known[near] & known[far]
    bones = places[far] - places[near]
    sizes = np.hypot(bones[:, 0], bones[:, 1])
    short = sizes - np.maximum(unsure_px[near], unsure_px[far])
    excess = np.maximum(short / lengths - 1.0 - _LENGTH_SLACK, 0.0)
    nats = np.minimum(0.5 * (excess / _LENGTH_SIGMA) ** 2, _LENGTH_NATS)
    return float(nats[both].sum()) + _bent_both_ways(chains, bones, sizes, both, unsure_px)


def _bent_both_ways(
    chains: Chains, bones: Array, sizes: Array, both: Mask, unsure_px: Array
) -> float:
    nats = 0.0
    for triple in chains.triples:
        if not both[triple].all() or unsure_px[chains.spans[triple]].any():
            continue
        (ax, ay), (bx, by), (cx, cy) = bones[triple].tolist()
        a, b, c = sizes[triple].tolist()
        first = (ax * by - ay * bx) / max(a * b, 1e-9)
        second = (bx * cy - by * cx) / max(b * c, 1e-9)
        if first * second < 0.0 and min(abs(first), abs(second)) > _BENT:
            nats += _BOTH_WAYS_NATS
    return nats
