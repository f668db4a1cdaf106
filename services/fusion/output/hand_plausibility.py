"""Whether points can belong to one hand.

A blob of the right colour that is not the marker (a reflection, something on the desk), or a view
that is mirrored by a wrong setting, gives points that each look sound: their rays meet. Together
they do not fit into a hand. A point further from the middle of the others than a hand reaches is
left out. If less than half of the markers that two cameras detect remain, all are left out.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import LANDMARKS, HandModel, forward, landmark_point
from services.fusion.arrays import Bools

# Distances are from the middle (median) of the points, a palm's length from the wrist at most; 1.25
# leaves room for a scale that is off.
_MARGIN = 1.25
# A young or predicted point may be off by its own sigma; three of them are as good as certain.
_SIGMAS = 3.0


def hand_reach_m(model: HandModel) -> float:
    """The longest distance of a landmark from the wrist, hand open."""
    positions, rotations = forward(model, np.eye(3), np.zeros(3), np.zeros((5, 4)))
    return max(
        float(np.linalg.norm(landmark_point(model, name, positions, rotations)))
        for name in LANDMARKS
    )


@njit(cache=True)
def coherent(
    positions: Array, covariances: Array, found: Bools, detected: Bools, reach_m: float
) -> Bools:
    """Which of one hand's points (n, 3), of those found (n,), form a hand of that reach.

    detected (n,) are the markers that two cameras detect. One or two points cannot be judged: they
    are kept.
    """
    kept = found.copy()
    rows = np.flatnonzero(found)
    if rows.size >= 3:
        middle = np.empty(3)
        for i in range(3):
            middle[i] = np.median(positions[rows, i])
        for row in rows:
            variance = covariances[row, 0, 0] + covariances[row, 1, 1] + covariances[row, 2, 2]
            off = positions[row] - middle
            distance = math.sqrt(off[0] ** 2 + off[1] ** 2 + off[2] ** 2)
            kept[row] = distance <= _MARGIN * reach_m + _SIGMAS * math.sqrt(max(variance, 0.0))
    if 2 * np.count_nonzero(kept) < np.count_nonzero(detected):
        kept[:] = False
    return kept
