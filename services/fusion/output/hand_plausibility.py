"""Whether points can belong to one hand.

A blob of the right colour that is not the marker (a reflection, something on the desk), or a view
that is mirrored by a wrong setting, gives points that each look sound: their rays meet. Together
they do not fit into a hand. A point further from the middle of the others than a hand reaches is
left out. If less than half of the markers that two cameras detect remain, all are left out.
"""

from __future__ import annotations

import numpy as np

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


def coherent(
    positions_m: Array, covariances_m2: Array, found: Bools, detected: Bools, reach_m: float
) -> Bools:
    """Which of one hand's points (n, 3), of those found (n,), form a hand of that reach.

    detected (n,) are the markers that two cameras detect. One or two points cannot be judged: they
    are kept.
    """
    if np.count_nonzero(found) >= 3:
        middle = np.median(positions_m[found], axis=0)
        sigmas = np.sqrt(np.maximum(np.einsum("nii->n", covariances_m2), 0.0))
        distances = np.linalg.norm(positions_m - middle, axis=1)
        found = found & (distances <= _MARGIN * reach_m + _SIGMAS * sigmas)
    if 2 * np.count_nonzero(found) < np.count_nonzero(detected):
        return np.zeros_like(found)
    return found
