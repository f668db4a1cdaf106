"""Which points of a HandPoints message are fit to be solved with.

Values may be absurd (1e300, all equal, from another hand). A point is dropped when it is unknown, a
repetition, not finite, out of range, or too uncertain to say anything; and of points that lie
further apart than one hand can be, those that disagree with most others. Missing points are no
error: fewer equations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rhot.messages import HandPoint, HandPoints
from services.solver.whole_hand.landmarks import Landmark, Observation

# No camera of this kind sees a finger tip 10 m away.
_MAX_RANGE_M = 10.0
# A point known to no better than a hand's length says nothing of a posture; one better than 0.3 mm
# is not skin.
_MIN_SIGMA_M, _MAX_SIGMA_M = 3e-4, 0.15
# A point carried on by fusion is trusted a third as much as one seen: its sigma says how it was
# filtered, not that it turned.
_PREDICTED_SIGMA_FACTOR = 3.0
# Two points of one hand may be further apart than the model says when its bones were never
# measured.
_REACH_MARGIN = 1.25


def usable_points(points: HandPoints, landmarks: Mapping[str, Landmark]) -> dict[str, Observation]:
    """The points worth solving with, by landmark, in the order of the message."""
    observed: dict[str, Observation] = {}
    for point in points.points:
        if point.name in landmarks and point.name not in observed and _is_plausible(point):
            measured = point.source == "measured"
            factor = 1.0 if measured else _PREDICTED_SIGMA_FACTOR
            sigma = np.clip(point.sigma_m, _MIN_SIGMA_M, _MAX_SIGMA_M) * factor
            observed[point.name] = Observation(np.array(point.position_m), 1.0 / sigma, measured)
    return _reject_outliers(observed, landmarks)


def _is_plausible(point: HandPoint) -> bool:
    """Whether a point's values are finite and within range."""
    in_range = all(math.isfinite(v) and abs(v) <= _MAX_RANGE_M for v in point.position_m)
    return in_range and all(math.isfinite(s) and s <= _MAX_SIGMA_M for s in point.sigma_m)


def _reject_outliers(
    observed: dict[str, Observation], landmarks: Mapping[str, Landmark]
) -> dict[str, Observation]:
    """Drop, one at a time, the point that is further from most others than a hand is long."""
    while len(observed) > 1:
        names = list(observed)
        points = np.array([observed[name].point_m for name in names])  # (m, 3)
        reach = np.array([landmarks[name].reach_m for name in names])  # (m,)
        apart = np.linalg.norm(points[:, None] - points[None], axis=2)  # (m, m)
        conflicts = (apart > _REACH_MARGIN * (reach[:, None] + reach[None])).sum(axis=1)
        worst = int(conflicts.argmax())
        if conflicts[worst] == 0:
            break
        observed = {name: observed[name] for name in names if name != names[worst]}
    return observed
