"""Located landmarks as the messages that go out: rounded, and without what is of no use.

All numbers of a message are made in one compiled call; Python only puts them into messages.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.messages import HandPoint, PointSource
from services.fusion.arrays import Bools
from services.fusion.intake.observations import Landmark
from services.fusion.method import Estimates

# Positions and sigmas are rounded to a micrometre: a hundredth of the smallest sigma of a hand at
# arm's length.
_PER_M = 1e6
# Covariances to as many digits as sigmas' squares need.
_PER_M2 = 1e13
# The upper triangle, as HandPoint.covariance_m2 has it.
_ROWS, _COLUMNS = np.triu_indices(3)


def usable_points(positions_m: Array, covariances_m2: Array, found: Bools) -> Bools:
    """Which of the found points (L,) are numbers: positions (L, 3), covariances (L, 3, 3)."""
    usable: Bools = _usable(positions_m, covariances_m2, found)
    return usable


@njit(cache=True)
def _usable(positions: Array, covariances: Array, found: Bools) -> Bools:
    usable = found.copy()
    for row in range(found.size):
        for i in range(3):
            usable[row] &= np.isfinite(positions[row, i]) and np.isfinite(covariances[row, i, i])
    return usable


class PointMessages:
    """Makes the messages of L landmarks seen by C cameras."""

    def __init__(self, landmarks: tuple[Landmark, ...], cameras: list[str]) -> None:
        self._names = [landmark.name for landmark in landmarks]
        self._cameras = cameras

    def of(
        self, rows: list[int], positions_m: Array, covariances_m2: Array, estimates: Estimates
    ) -> list[HandPoint]:
        """Some landmarks' messages; positions (L, 3), covariances (L, 3, 3) as they go out."""
        numbers = _rounded(positions_m, covariances_m2).tolist()
        seen_by, measured = estimates.seen_by.tolist(), estimates.measured.tolist()
        return [self._point(row, numbers[row], seen_by[row], measured[row]) for row in rows]

    def _point(
        self, row: int, numbers: list[float], seen_by: list[bool], measured: bool
    ) -> HandPoint:
        x, y, z, sx, sy, sz, *covariance = numbers
        source: PointSource = "measured" if measured else "predicted"
        return HandPoint(
            name=self._names[row],
            position_m=(x, y, z),
            sigma_m=(sx, sy, sz),
            cameras=[name for name, sees in zip(self._cameras, seen_by, strict=True) if sees],
            source=source,
            covariance_m2=tuple(covariance),  # type: ignore[arg-type]
        )


@njit(cache=True)
def _rounded(positions: Array, covariances: Array) -> Array:
    """Position, sigmas and upper triangle of the covariance of points, rounded; (L, 12)."""
    numbers = np.empty((positions.shape[0], 12))
    for row in range(positions.shape[0]):
        for i in range(3):
            sigma = np.sqrt(max(covariances[row, i, i], 0.0))
            numbers[row, i] = np.rint(positions[row, i] * _PER_M) / _PER_M
            numbers[row, 3 + i] = max(np.rint(sigma * _PER_M), 1.0) / _PER_M
        for n in range(6):
            value = covariances[row, _ROWS[n], _COLUMNS[n]]
            numbers[row, 6 + n] = np.rint(value * _PER_M2) / _PER_M2
    return numbers
