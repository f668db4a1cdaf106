"""Which points of a HandPoints message are fit to be solved with.

Values may be absurd (1e300, all equal, from another hand). A point is dropped when it is unknown, a
repetition, not finite, out of range, or too uncertain to say anything; and of points that lie
further apart than one hand can be, those that disagree with most others. A point that one camera
sees says enough: where it is across that camera's ray. Missing points are no error: fewer
equations.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.messages import HandPoint, HandPoints
from services.solver.maths.symmetric import eigen
from services.solver.whole_hand.landmarks import Bools, Landmarks, Observed, places_at

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
# What a single camera sees is predicted along its ray, and the landmarks of a hand are wrong there
# together: six of them tell its distance no better than one. Beyond that, bones and the habitual
# posture decide how far away the hand is: at 5 a hand that plays drifted by 14 mm within a second,
# whose points were 6 mm off. Tips over a second of one camera, and three tips for .5 s (tuning half
# of benchmarks/one_camera_poses.py, geometric mean, mm): at 1 14.7 and 3.1, at 2 14.5 and 2.4, at
# this 14.6 and 2.4, at 5 18.4 and 2.5.
_RAY_SIGMA_FACTOR = math.sqrt(6.0)
# So many of its own sigmas further than it reaches may a point seem to be: the distance along a
# single camera's ray is hardly known.
_VAGUE_SIGMAS = 2.0
# Two points of one hand may be further apart than the model says when its bones were never
# measured.
_REACH_MARGIN = 1.25


# What a row of numbers begins with: sigmas along the axes, or a covariance.
_SIGMAS, _COVARIANCE = 0.0, 1.0
# Who saw a point, and what that makes of its sigmas: nobody's is multiplied.
_MEASURED, _PREDICTED, _ONE_CAMERA = 0.0, 1.0, 2.0


def usable_points(points: HandPoints, landmarks: Landmarks, more_m2: float = 0.0) -> Observed:
    """The points worth solving with, by landmark, in the order of the message.

    more_m2: a variance along each axis beside that of measuring.
    """
    seen: dict[str, HandPoint] = {}
    for point in points.points:
        # The first usable one of a name counts; nearly always there is one.
        if point.name in landmarks and (
            point.name not in seen or not _usable(_rows([seen[point.name]]))[1][0]
        ):
            seen[point.name] = point
    names, rows = tuple(seen), _rows(seen.values())
    places = landmarks.packed(names)
    # To be filled: an array that a kernel returns costs .6 us, one that it is given .2.
    positions, covariances = np.empty((len(names), 3)), np.empty((len(names), 3, 3))
    measured = np.empty(len(names), dtype=np.bool_)
    if _check(rows, places.address, more_m2, positions, covariances, measured):
        return Observed(names, positions, covariances, measured)
    return _without_outliers(names, rows, landmarks, more_m2)


def _rows(points: Collection[HandPoint]) -> Array:
    """Points as numbers (n, 11): position, six of the covariance or sigmas, and what they are."""
    numbers: list[float] = []
    for point in points:
        kind, values = _COVARIANCE, point.covariance_m2
        if values is None:
            x, y, z = point.sigma_m
            kind, values = _SIGMAS, (x, 0.0, 0.0, y, 0.0, z)
        seen_by = _MEASURED
        if point.source == "predicted":
            seen_by = _ONE_CAMERA if len(point.cameras) == 1 else _PREDICTED
        numbers += (*point.position_m, *values, kind, seen_by)
    return np.array(numbers, dtype=np.float64).reshape(-1, 11)


@njit(cache=True)
def _check(
    rows: Array,
    places: int,
    more_m2: float,
    positions: Array,
    covariances: Array,
    measured: Bools,
) -> bool:
    """To positions (n, 3), covariances (n, 3, 3), and who is measured (n,); whether all are sound.

    Of points that sit at places (PLACES); the covariances with more_m2 along each axis.
    """
    believed, usable = _usable(rows)
    for n in range(rows.shape[0]):
        for i in range(3):
            positions[n, i] = rows[n, i]
            for k in range(3):
                covariances[n, i, k] = believed[n, i, k]
            covariances[n, i, i] += more_m2
        measured[n] = rows[n, 10] == _MEASURED
    return bool(usable.all()) and _worst_outlier(positions, believed, places_at(places).reach_m) < 0


@njit(cache=True)
def _usable(rows: Array) -> tuple[Array, Bools]:
    """What points' errors are believed to be (n, 3, 3), m^2, and whether (n,) that is plausible."""
    covariances = np.zeros((rows.shape[0], 3, 3))
    usable = np.zeros(rows.shape[0], dtype=np.bool_)
    for n in range(rows.shape[0]):
        in_range = True
        for value in rows[n, :9]:
            # Not true of what is not a number.
            in_range &= abs(value) <= _MAX_RANGE_M
        if in_range:
            usable[n] = _believed(rows[n], covariances[n])
    return covariances, usable


@njit(cache=True)
def _believed(row: Array, C: Array) -> bool:
    """Fill C (3, 3) with a point's covariance as it is believed; False: nothing is."""
    xx, xy, xz, yy, yz, zz = row[3:9]
    if row[9] == _SIGMAS:
        sigmas, axes = np.array([xx, yy, zz]), np.eye(3)
    else:
        C[0, 0], C[1, 1], C[2, 2] = xx, yy, zz
        C[0, 1] = C[1, 0] = xy
        C[0, 2] = C[2, 0] = xz
        C[1, 2] = C[2, 1] = yz
        # Nearly always no sigma is out of range; then the axes need not be known.
        if row[10] != _ONE_CAMERA and xx + yy + zz <= _MAX_SIGMA_M**2 and _above_least(C):
            if row[10] == _PREDICTED:
                C *= _PREDICTED_SIGMA_FACTOR**2
            return True
        axes = np.empty((3, 3))
        eigen(C, axes)
        variances = np.diag(C)
        if variances.min() < -(_MIN_SIGMA_M**2):
            return False
        sigmas = np.sqrt(np.maximum(variances, 0.0))
    if np.count_nonzero(sigmas <= _MAX_SIGMA_M) < 2:
        return False
    for i in range(3):
        sigmas[i] = min(max(sigmas[i], _MIN_SIGMA_M), _MAX_RAY_SIGMA_M)
    if row[10] == _ONE_CAMERA:
        sigmas[sigmas.argmax()] *= _RAY_SIGMA_FACTOR
    elif row[10] == _PREDICTED:
        sigmas *= _PREDICTED_SIGMA_FACTOR
    for i in range(3):
        for j in range(3):
            C[i, j] = 0.0
            for k in range(3):
                C[i, j] += axes[i, k] * sigmas[k] ** 2 * axes[j, k]
    return True


@njit(cache=True)
def _above_least(C: Array) -> bool:
    """Whether every standard deviation of C (3, 3) is beyond the least: C less that is definite."""
    least = _MIN_SIGMA_M**2
    a, b, c = C[0, 0] - least, C[1, 1] - least, C[2, 2] - least
    minor = a * b - C[0, 1] ** 2
    determinant = (
        a * (b * c - C[1, 2] ** 2)
        - C[0, 1] * (C[0, 1] * c - C[1, 2] * C[0, 2])
        + C[0, 2] * (C[0, 1] * C[1, 2] - b * C[0, 2])
    )
    return a > 0.0 and minor > 0.0 and determinant > 0.0


def _without_outliers(
    names: tuple[str, ...], rows: Array, landmarks: Landmarks, more_m2: float
) -> Observed:
    """The usable ones, less, one at a time, the point that is further from most others than a hand
    is long.
    """
    covariances, usable = _usable(rows)
    kept = np.flatnonzero(usable)
    while len(kept) > 1:
        reach_m = landmarks.places(tuple(names[n] for n in kept)).reach_m
        worst = _worst_outlier(rows[kept, :3], covariances[kept], reach_m)
        if worst < 0:
            break
        kept = np.delete(kept, worst)
    return Observed(
        [names[n] for n in kept],
        rows[kept, :3].copy(),
        covariances[kept] + more_m2 * np.eye(3),
        rows[kept, 10] == _MEASURED,
    )


@njit(cache=True)
def _worst_outlier(points: Array, covariances: Array, reach_m: Array) -> int:
    """Which of points (m, 3) is too far from most others, -1 if none is from any."""
    m = points.shape[0]
    if m < 2:
        return -1
    reach, conflicts = np.empty(m), np.zeros(m, np.int64)
    for n in range(m):
        trace = covariances[n, 0, 0] + covariances[n, 1, 1] + covariances[n, 2, 2]
        reach[n] = reach_m[n] + _VAGUE_SIGMAS * math.sqrt(trace)
        for k in range(n):
            square = 0.0
            for i in range(3):
                square += (points[n, i] - points[k, i]) ** 2
            if math.sqrt(square) > _REACH_MARGIN * (reach[n] + reach[k]):
                conflicts[n] += 1
                conflicts[k] += 1
    worst = int(conflicts.argmax())
    return worst if conflicts[worst] > 0 else -1
