"""Located landmarks as the messages that go out: rounded, and without what is of no use.

All numbers of all messages are made in one compiled call; Python only puts them into messages. What
a call touches is cold by the next frame: many small ones cost more than what they compute.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import HandName
from rhot.kernels.packed import Layout, unowned
from rhot.messages import HandPoint
from services.fusion.alignment.level_views import add_turns
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.intake.observations import Landmark
from services.fusion.method import Estimates
from services.fusion.output.hand_plausibility import coherent
from services.fusion.output.systematic_error import Systematic, add_systematic
from services.fusion.paint.hidden_paint import PaintSeen
from services.fusion.paint.known_paint import KnownPaint, correct_paint

# Positions and sigmas are rounded to a micrometre: a hundredth of the smallest sigma of a hand at
# arm's length.
_PER_M = 1e6
# Covariances to as many digits as sigmas' squares need.
_PER_M2 = 1e13
# The upper triangle, as HandPoint.covariance_m2 has it.
_ROWS, _COLUMNS = np.triu_indices(3)


class Corrections(NamedTuple):
    """What turns located paint into points, by what is known of it at the time."""

    paint: KnownPaint
    systematic: Systematic
    seen: PaintSeen
    cameras: Extrinsics
    turns: Array  # (C, 3) by which cameras are turned, rad about the rig's axes


class _Points(NamedTuple):
    """All that points are made of beside estimates, and what becomes of them."""

    corrections: Corrections
    hand_of: Ints  # (L,) whose a landmark is
    reach_m: Array  # (H,) each hand's
    numbers: Array  # (L, 12) of points, rounded
    kept: Bools  # (L,) which of them are told


_POINTS = Layout()
_points_at = _POINTS.at


class PointMessages:
    """Makes the messages of L landmarks seen by C cameras."""

    def __init__(
        self,
        landmarks: tuple[Landmark, ...],
        reach_m: Mapping[HandName, float],
        cameras: Sequence[str],
        corrections: Corrections,
    ) -> None:
        """reach_m: of every hand, in the order of the messages (hand_plausibility.py).

        corrections: what their owners keep up to date; places that are seen are written here.
        """
        self._names = [landmark.name for landmark in landmarks]
        self._hands = list(reach_m)
        self._cameras = cameras
        hand_of = [self._hands.index(landmark.hand) for landmark in landmarks]
        self._hand_names = [landmark.hand for landmark in landmarks]
        self._points = _Points(
            corrections,
            np.array(hand_of, dtype=np.int64),
            np.array(list(reach_m.values())),
            np.empty((len(landmarks), 12)),
            np.empty(len(landmarks), dtype=np.bool_),
        )
        self._packed = _POINTS.pack(self._points)
        # Names of the cameras that see a landmark, by whether each does: few different lists.
        self._seen_by: dict[tuple[bool, ...], list[str]] = {}

    def of(
        self, estimates: Estimates, instant_ns: int
    ) -> tuple[dict[HandName, list[HandPoint]], int]:
        """The points of every hand, and how many were left out as they do not belong to theirs.

        estimates: of paint's centres.
        """
        incoherent = _point_numbers(self._packed.address, instant_ns, *estimates)
        points: dict[HandName, list[HandPoint]] = {hand: [] for hand in self._hands}
        told = zip(
            self._points.kept.tolist(),
            self._names,
            self._hand_names,
            self._points.numbers.tolist(),
            estimates.seen_by.tolist(),
            estimates.measured.tolist(),
            strict=True,
        )
        for kept, name, hand, (x, y, z, sx, sy, sz, xx, xy, xz, yy, yz, zz), seen, measured in told:
            if kept:
                point = HandPoint(
                    name=name,
                    position_m=(x, y, z),
                    sigma_m=(sx, sy, sz),
                    cameras=self._named(tuple(seen)),
                    source="measured" if measured else "predicted",
                    covariance_m2=(xx, xy, xz, yy, yz, zz),
                )
                points[hand].append(point)
        return points, incoherent

    def _named(self, seen_by: tuple[bool, ...]) -> list[str]:
        """The cameras that see a landmark; of which each does."""
        cameras = self._seen_by.get(seen_by)
        if cameras is None:
            cameras = [name for name, sees in zip(self._cameras, seen_by, strict=True) if sees]
            self._seen_by[seen_by] = cameras
        return cameras


@njit(cache=True)
def _point_numbers(address: int, instant_ns: int, *row: Any) -> int:
    """Fill the numbers of points, and which of them to tell; how many are incoherent.

    address: of _Points; row: Estimates.
    """
    estimates = unowned(Estimates(*row))
    positions, covariances = estimates.positions_m.copy(), estimates.covariances_m2.copy()
    return _correct_and_round(_points_at(address), instant_ns, estimates, positions, covariances)


@njit(cache=True)
def _correct_and_round(
    points: _Points, instant_ns: int, estimates: Estimates, positions: Array, covariances: Array
) -> int:
    """_point_numbers from copies of positions (L, 3) and covariances (L, 3, 3), written over."""
    positions, covariances = unowned(positions), unowned(covariances)
    known = points.corrections
    seen, cameras = known.seen, known.cameras
    found, seen_by = estimates.found, estimates.seen_by
    correct_paint(known.paint, instant_ns, positions, covariances, seen_by, cameras)
    seen.places[:] = np.nan
    for k in np.flatnonzero(found):
        seen.places[k] = positions[k]
    add_systematic(known.systematic, seen.sigmas, positions, seen_by, cameras, covariances)
    add_turns(known.turns, cameras, positions, covariances)
    usable = _usable(positions, covariances, found)
    kept = points.kept
    kept[:] = False
    for hand in range(points.reach_m.size):
        rows = np.flatnonzero(points.hand_of == hand)
        detected = estimates.detected[rows]
        kept[rows] = coherent(
            positions[rows], covariances[rows], usable[rows], detected, points.reach_m[hand]
        )
    _round(positions, covariances, points.numbers)
    return int(np.count_nonzero(usable) - np.count_nonzero(kept))


@njit(cache=True)
def _usable(positions: Array, covariances: Array, found: Bools) -> Bools:
    """Which of the found points (L,) are numbers: positions (L, 3), covariances (L, 3, 3)."""
    usable = found.copy()
    for row in range(found.size):
        for i in range(3):
            usable[row] &= np.isfinite(positions[row, i]) and np.isfinite(covariances[row, i, i])
    return usable


@njit(cache=True)
def _round(positions: Array, covariances: Array, numbers: Array) -> None:
    """Position, sigmas and upper triangle of the covariance of points, rounded, to (L, 12)."""
    for row in range(positions.shape[0]):
        for i in range(3):
            sigma = np.sqrt(max(covariances[row, i, i], 0.0))
            numbers[row, i] = np.rint(positions[row, i] * _PER_M) / _PER_M
            numbers[row, 3 + i] = max(np.rint(sigma * _PER_M), 1.0) / _PER_M
        for n in range(6):
            value = covariances[row, _ROWS[n], _COLUMNS[n]]
            numbers[row, 6 + n] = np.rint(value * _PER_M2) / _PER_M2
