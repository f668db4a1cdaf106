"""One calibration as a least-squares problem: how unlikely a person and a set of poses are, given the recording.

Frames come in takes: some seconds of one exercise. Within a take an angle has an expected value, and deviates from it by an offset
that lasts (nobody holds "straight" at exactly 0 deg) and by a part that changes; so that a hundred frames of one take do not
count as a hundred independent witnesses. Joint limits are soft here: they are the average person's, and what is looked for is this one's.
A landmark that is missing in a frame has the weight 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.transforms import Array, rotation_from_vector
from services.solver.person.marks import UNKNOWNS, Marks, marks_of
from services.solver.person.shape import Geometry, Shape

# Deviation of DIP from ratio * PIP, lasting and changing: as in services/solver/constraints.py, where one look has no lasting part.
_COUPLING_RAD = np.deg2rad([4.0, 4.0])
# Beyond a table's limit the next 5 deg are one standard deviation; the edge is rounded over 2 deg, or else the optimum jumps.
_LIMIT_RAD, _EDGE_RAD = np.deg2rad(5.0), np.deg2rad(2.0)
# As in whole_hand.py: beyond 5 standard deviations a marker counts linearly.
_HUBER = 5.0


@dataclass(frozen=True)
class Take:
    """Frames first..first+count of one exercise; expected angles (20,) rad and standard deviations, lasting and changing (20,)."""

    name: str
    first: int
    count: int
    expected: Array
    lasting: Array
    changing: Array

    @property
    def rows(self) -> slice:
        """Its frames."""
        return slice(self.first, self.first + self.count)


class Poses(NamedTuple):
    """The hand in every frame."""

    rotations: Array  # (n, 3, 3) wrist in the rig frame
    positions: Array  # (n, 3)
    angles: Array  # (n, 5, 4)

    def moved(self, step: Array) -> Poses:
        """After a step (n, 26) in the wrist frame."""
        turns = np.array([rotation_from_vector(v) for v in step[:, :3]])
        shifts = np.einsum("nij,nj->ni", self.rotations, step[:, 3:6])
        return Poses(self.rotations @ turns, self.positions + shifts, self.angles + step[:, 6:].reshape(-1, 5, 4))


@dataclass(frozen=True)
class Problem:
    """What was seen: points (n, m, 3) in the rig frame and weights 1/sigma^2 (n, m, 3), 0 where missing; and what is expected."""

    shape: Shape
    points: Array
    weights: Array
    takes: tuple[Take, ...]
    limits: Array  # (5, 4, 2) rad


class TakeEquations(NamedTuple):
    """Normal equations of one take of k frames."""

    H: Array  # (26 k, 26 k)
    X: Array  # (26 k, unknowns) with the person's unknowns
    g: Array  # (26 k,)


class Equations(NamedTuple):
    """Normal equations at (x, poses); cost is the sum of squares in standard deviations."""

    cost: float
    takes: list[TakeEquations]
    H: Array  # (unknowns, unknowns) of the person
    g: Array  # (unknowns,)
    measures: Geometry
    marks: Marks
    weights: Array  # (n, m, 3, 3) in the wrist frame, with Huber's factor
    edges: tuple[Array, Array]  # first derivative of the soft limits' residuals and its derivative, (n, 20) each


def equations(problem: Problem, x: Array, poses: Poses) -> Equations:
    """Linearise everything."""
    shape = problem.shape
    measures = shape.geometry(x)
    marks = marks_of(shape, measures, poses.angles, shape.table.side)
    R = poses.rotations
    error = marks.points - np.einsum("nji,nmj->nmi", R, problem.points - poses.positions[:, None])
    weights = np.einsum("nji,nmj,njk->nmik", R, problem.weights, R)
    square = np.einsum("nmi,nmij,nmj->nm", error, weights, error)
    distance = np.sqrt(square)
    factor = np.where(distance <= _HUBER, 1.0, _HUBER / np.maximum(distance, _HUBER))
    weights = weights * factor[:, :, None, None]
    cost = float(np.where(distance <= _HUBER, square, _HUBER * (2.0 * distance - _HUBER)).sum()) + float(x @ x)
    Jx = marks.by_measure @ measures.G
    WJ = weights @ marks.J
    frame_H = np.einsum("nmia,nmib->nab", WJ, marks.J)
    frame_X = np.einsum("nmia,nmib->nab", WJ, Jx)
    frame_g = np.einsum("nmia,nmi->na", WJ, error)
    flat = Jx.reshape(-1, shape.unknowns)
    H = flat.T @ (weights @ Jx).reshape(-1, shape.unknowns) + np.eye(shape.unknowns)
    g = flat.T @ np.einsum("nmij,nmj->nmi", weights, error).ravel() + x
    residual, slope, bend = _edges(poses.angles.reshape(-1, 20), problem.limits.reshape(20, 2))
    cost += float((residual**2).sum())
    frame_g[:, 6:] += slope * residual
    diagonal = np.arange(6, UNKNOWNS)
    frame_H[:, diagonal, diagonal] += slope**2
    takes = []
    for take in problem.takes:
        rows = take.rows
        own, more = _expected(take, poses.angles[rows], frame_H[rows], frame_X[rows], frame_g[rows])
        cost += more + _coupled(take, poses.angles[rows], measures, own, H, g)
        size = UNKNOWNS * take.count
        takes.append(TakeEquations(own.H.reshape(size, size), own.X.reshape(size, -1), own.g.reshape(size)))
    return Equations(cost, takes, H, g, measures, marks, weights, (slope, bend))


def lasting_information(count: int, lasting: float, changing: float) -> Array:
    """Inverse of changing^2 I + lasting^2 11', (count, count)."""
    return (np.eye(count) - lasting**2 / (changing**2 + count * lasting**2)) / changing**2


def coupling_information(count: int) -> Array:
    """Of the deviations of DIP from ratio * PIP in a take's frames."""
    return lasting_information(count, float(_COUPLING_RAD[0]), float(_COUPLING_RAD[1]))


def _expected(take: Take, angles: Array, H: Array, X: Array, g: Array) -> tuple[TakeEquations, float]:
    """A take's equations with what is expected of its angles; H becomes (k, 26, k, 26)."""
    k, cost = take.count, 0.0
    full = np.zeros((k, UNKNOWNS, k, UNKNOWNS))
    full[np.arange(k), :, np.arange(k), :] = H
    g = g.copy()
    for a in range(20):
        information = lasting_information(k, take.lasting[a], take.changing[a])
        off = angles.reshape(k, 20)[:, a] - take.expected[a]
        pull = information @ off
        full[:, 6 + a, :, 6 + a] += information
        g[:, 6 + a] += pull
        cost += float(off @ pull)
    return TakeEquations(full, X.copy(), g), cost


def _coupled(take: Take, angles: Array, measures: Geometry, own: TakeEquations, H: Array, g: Array) -> float:
    """Add DIP = ratio * PIP of all digits; returns its cost."""
    information, cost = coupling_information(take.count), 0.0
    for row, ratio in enumerate(measures.ratios.tolist()):
        second, last = 6 + 4 * row + 2, 6 + 4 * row + 3
        unknown = len(g) - 5 + row
        pull = information @ (angles[:, row, 3] - ratio * angles[:, row, 2])
        by_ratio = -angles[:, row, 2] * measures.G[-5 + row, unknown]
        for i, di in ((second, -ratio), (last, 1.0)):
            own.g[:, i] += di * pull
            own.X[:, i, unknown] += di * (information @ by_ratio)
            for j, dj in ((second, -ratio), (last, 1.0)):
                own.H[:, i, :, j] += di * dj * information
        g[unknown] += by_ratio @ pull
        H[unknown, unknown] += by_ratio @ information @ by_ratio
        cost += float((angles[:, row, 3] - ratio * angles[:, row, 2]) @ pull)
    return cost


def _edges(angles: Array, limits: Array) -> tuple[Array, Array, Array]:
    """Soft limits' residuals (n, 20): a rounded ramp outside; their slope and the slope's slope by the angle."""
    out_low, out_high = (limits[:, 0] - angles) / _EDGE_RAD, (angles - limits[:, 1]) / _EDGE_RAD
    scale = _EDGE_RAD / _LIMIT_RAD
    low, high = np.logaddexp(0.0, out_low), np.logaddexp(0.0, out_high)
    s_low, s_high = 1.0 / (1.0 + np.exp(-np.clip(out_low, -60, 60))), 1.0 / (1.0 + np.exp(-np.clip(out_high, -60, 60)))
    slope = (s_high - s_low) / _LIMIT_RAD
    bend = (s_high * (1.0 - s_high) + s_low * (1.0 - s_low)) / (_LIMIT_RAD * _EDGE_RAD)
    return scale * (high + low), slope, bend
