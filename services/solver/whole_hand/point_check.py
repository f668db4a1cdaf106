"""Which points of a HandPoints message are fit to be solved with.

Values may be absurd (1e300, all equal, from another hand). A point is dropped when it is unknown, a
repetition, not finite, out of range, or too uncertain to say anything; and of points that lie
further apart than one hand can be, those that disagree with most others. A point that one camera
sees says enough: where it is across that camera's ray. Missing points are no error: fewer
equations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rhot.geometry.transforms import Array
from rhot.messages import HandPoint, HandPoints
from services.solver.whole_hand.landmarks import Landmark, Observation

# No camera of this kind sees a finger tip 10 m away.
_MAX_RANGE_M = 10.0
# A point known to no better than a hand's length says nothing of a posture, unless one camera sees
# it: then two directions are known better, and the third may be anything. One better than 0.3 mm is
# not skin.
_MIN_SIGMA_M, _MAX_SIGMA_M = 3e-4, 0.15
# Along a camera's ray: no more than the distance at which cameras of this kind see a hand well.
_MAX_RAY_SIGMA_M = 1.0
# A point that no camera sees is trusted a third as much as one seen: its sigma says how it was
# filtered, not that it turned.
_PREDICTED_SIGMA_FACTOR = 3.0
# What a single camera sees is predicted along its ray, and all landmarks of a hand are wrong there
# together. Tips of turning hands seen by one camera (synthetic points, .06 px; fists and random
# motions), for .3 s and then to 1 s, mm RMS: at 3 9.3 and 69, at 6 10.1 and 56, at 10 12.2 and 45,
# at 1000 50 and 77; without such points 17 and 106.
_RAY_SIGMA_FACTOR = 5.0
# So many of its own sigmas further than it reaches may a point seem to be: the distance along a
# single camera's ray is hardly known.
_VAGUE_SIGMAS = 2.0
# Two points of one hand may be further apart than the model says when its bones were never
# measured.
_REACH_MARGIN = 1.25


def usable_points(points: HandPoints, landmarks: Mapping[str, Landmark]) -> dict[str, Observation]:
    """The points worth solving with, by landmark, in the order of the message."""
    observed: dict[str, Observation] = {}
    for point in points.points:
        if point.name in landmarks and point.name not in observed:
            covariance = _covariance(point)
            if covariance is not None:
                position, measured = np.array(point.position_m), point.source == "measured"
                observed[point.name] = Observation(position, covariance, measured)
    return _reject_outliers(observed, landmarks)


def _covariance(point: HandPoint) -> Array | None:
    """What a point's error is believed to be (3, 3), m^2; None: nothing, or it is not plausible."""
    values = point.covariance_m2 or (point.sigma_m[0], 0, 0, point.sigma_m[1], 0, point.sigma_m[2])
    known = (*point.position_m, *values)
    if not all(math.isfinite(v) and abs(v) <= _MAX_RANGE_M for v in known):
        return None
    if point.covariance_m2 is None:
        sigmas, axes = np.array(point.sigma_m), np.eye(3)
    else:
        xx, xy, xz, yy, yz, zz = point.covariance_m2
        variances, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        if variances[0] < -(_MIN_SIGMA_M**2):
            return None
        sigmas = np.sqrt(np.maximum(variances, 0.0))
    if np.count_nonzero(sigmas <= _MAX_SIGMA_M) < 2:
        return None
    sigmas = np.clip(sigmas, _MIN_SIGMA_M, _MAX_RAY_SIGMA_M)
    if point.source == "predicted":
        if len(point.cameras) == 1:
            sigmas[sigmas.argmax()] *= _RAY_SIGMA_FACTOR
        else:
            sigmas *= _PREDICTED_SIGMA_FACTOR
    return axes * sigmas**2 @ axes.T


def _reject_outliers(
    observed: dict[str, Observation], landmarks: Mapping[str, Landmark]
) -> dict[str, Observation]:
    """Drop, one at a time, the point that is further from most others than a hand is long."""
    while len(observed) > 1:
        names = list(observed)
        points = np.array([observed[name].point_m for name in names])  # (m, 3)
        reach = np.array([landmarks[name].reach_m for name in names])  # (m,)
        vague = np.sqrt([np.trace(observed[name].covariance_m2) for name in names])  # (m,) sigmas
        reach += _VAGUE_SIGMAS * vague
        apart = np.linalg.norm(points[:, None] - points[None], axis=2)  # (m, m)
        conflicts = (apart > _REACH_MARGIN * (reach[:, None] + reach[None])).sum(axis=1)
        worst = int(conflicts.argmax())
        if conflicts[worst] == 0:
            break
        observed = {name: observed[name] for name in names if name != names[worst]}
    return observed
