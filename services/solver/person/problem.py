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
import numpy.typing as npt

from rhot.transforms import Array, rotation_from_vector
from services.solver.person.marks import UNKNOWNS, Marks, curved, marks_of
from services.solver.person.shape import Geometry, Shape

# An angle that may change by more says nothing of a person.
FREE_RAD = np.deg2rad(60.0)
# What lasts in a take: offsets of the 20 angles and of the five couplings.
OFFSETS = 25
# Deviation of DIP from ratio * PIP, lasting and changing: as in services/solver/constraints.py, where one look has no lasting part.
_COUPLING_RAD = np.deg2rad([4.0, 4.0])
# Beyond a table's limit the next 5 deg are one standard deviation; the edge is rounded over 2 deg, or else the optimum jumps.
_LIMIT_RAD, _EDGE_RAD = np.deg2rad(5.0), np.deg2rad(2.0)
# As in whole_hand.py: beyond 5 standard deviations a marker counts linearly.
_HUBER = 5.0


@dataclass(frozen=True)
class Take:
    """Some frames of one exercise: expected angles (20,) rad and their standard deviations, lasting and changing (20,)."""

    name: str
    count: int
    expected: Array
    lasting: Array
    changing: Array

    @property
    def free(self) -> npt.NDArray[np.bool_]:
        """(20,) which angles nothing is expected of."""
        return self.changing > FREE_RAD


class Poses(NamedTuple):
    """The hand in every frame, and what lasts in every take."""

    rotations: Array  # (n, 3, 3) wrist in the rig frame
    positions: Array  # (n, 3)
    angles: Array  # (n, 5, 4)
    offsets: Array  # (takes, 25) rad

    def moved(self, step: Array, offsets: Array) -> Poses:
        """After a step (n, 26) in the wrist frame and one of the offsets."""
        turns = np.array([rotation_from_vector(v) for v in step[:, :3]])
        shifts = np.einsum("nij,nj->ni", self.rotations, step[:, 3:6])
        return Poses(self.rotations @ turns, self.positions + shifts, self.angles + step[:, 6:].reshape(-1, 5, 4), self.offsets + offsets)


class Problem:
    """What was seen, points (n, m, 3) in the rig frame and weights 1/sigma^2 (n, m, 3), 0 where missing; and what is expected."""

    def __init__(self, shape: Shape, points: Array, weights: Array, takes: tuple[Take, ...], limits: Array) -> None:
        self.shape, self.points, self.weights, self.takes, self.limits = shape, points, weights, takes, limits
        counts = [take.count for take in takes]
        self.take_of = np.repeat(np.arange(len(takes)), counts)
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        self.free = np.array([take.free for take in takes])
        # Expected value (takes, 25) and 1/sd^2 of what lasts and what changes; of a coupling's deviation nothing is expected.
        self.expected = np.array([take.expected for take in takes])
        self.lasting = np.array([[*take.lasting**-2.0, *(_COUPLING_RAD[0] ** -2.0,) * 5] for take in takes])
        self.changing = np.array([[*take.changing**-2.0, *(_COUPLING_RAD[1] ** -2.0,) * 5] for take in takes])

    def by_take(self, values: Array) -> Array:
        """Sums over the frames of each take; (n, ...) -> (takes, ...)."""
        return np.add.reduceat(values, self.first, axis=0)


class Equations(NamedTuple):
    """Normal equations at (person, poses); n frames, t takes, p unknowns of the person.

    H is Gauss and Newton's matrix, which is definite; bent is what Newton's has more, and bent_X likewise.
    """

    costs: Array  # (t,) sums of squares in standard deviations
    H: Array  # (n, 26, 26)
    B: Array  # (n, 26, 25) with the take's offsets
    X: Array  # (n, 26, p) with the person
    g: Array  # (n, 26)
    offsets_H: Array  # (t, 25), diagonal
    offsets_X: Array  # (t, 25, p)
    offsets_g: Array  # (t, 25)
    person_H: Array  # (p, p)
    person_g: Array  # (p,)
    bent: Array  # (n, 26, 26)
    bent_X: Array  # (n, 26, p)
    measures: Geometry
    marks: Marks
    weights: Array  # (n, m, 3, 3) in the wrist frame, with Huber's factor
    edges: tuple[Array, Array]  # first and second derivative of the soft limits' residuals, (n, 20) each


def equations(problem: Problem, x: Array, poses: Poses) -> Equations:
    """Linearise everything."""
    shape = problem.shape
    measures = shape.geometry(x)
    marks = marks_of(shape, measures, poses.angles, shape.table.side)
    error, weights, cost = _errors(problem, marks, poses)
    pull = np.einsum("nmij,nmj->nmi", weights, error)
    Jx = marks.by_measure @ measures.G
    WJ = weights @ marks.J
    H = np.einsum("nmia,nmib->nab", WJ, marks.J)
    X = np.einsum("nmia,nmib->nab", WJ, Jx)
    g = np.einsum("nmia,nmi->na", marks.J, pull)
    person_H = np.einsum("nmia,nmib->ab", weights @ Jx, Jx) + np.eye(shape.unknowns)
    person_g = np.einsum("nmia,nmi->a", Jx, pull) + x
    bent, mixed = curved(shape, marks, pull)
    bent_X = mixed @ measures.G
    residual, slope, bend = _edges(poses.angles.reshape(-1, 20), problem.limits.reshape(20, 2))
    cost += (residual**2).sum(axis=1)
    diagonal = np.arange(6, UNKNOWNS)
    g[:, 6:] += slope * residual
    H[:, diagonal, diagonal] += slope**2
    bent[:, diagonal, diagonal] += bend * residual
    parts = Equations(
        costs=problem.by_take(cost) + (poses.offsets**2 * problem.lasting).sum(axis=1),
        H=H,
        B=np.zeros((len(H), UNKNOWNS, OFFSETS)),
        X=X,
        g=g,
        offsets_H=problem.lasting.copy(),
        offsets_X=np.zeros((len(problem.takes), OFFSETS, shape.unknowns)),
        offsets_g=problem.lasting * poses.offsets,
        person_H=person_H,
        person_g=person_g,
        bent=bent,
        bent_X=bent_X,
        measures=measures,
        marks=marks,
        weights=weights,
        edges=(slope, bend),
    )
    _add_expected(problem, poses, parts)
    _add_coupling(problem, poses, parts)
    return parts


def _errors(problem: Problem, marks: Marks, poses: Poses) -> tuple[Array, Array, Array]:
    """Of each landmark: error (n, m, 3) and weights (n, m, 3, 3) in the wrist frame; of each frame: Huber's cost (n,)."""
    R = poses.rotations
    error = marks.points - np.einsum("nji,nmj->nmi", R, problem.points - poses.positions[:, None])
    weights = np.einsum("nji,nmj,njk->nmik", R, problem.weights, R)
    square = np.maximum(np.einsum("nmi,nmij,nmj->nm", error, weights, error), 0.0)
    distance = np.sqrt(square)
    factor = np.where(distance <= _HUBER, 1.0, _HUBER / np.maximum(distance, _HUBER))
    cost = np.where(distance <= _HUBER, square, _HUBER * (2.0 * distance - _HUBER)).sum(axis=1)
    return error, weights * factor[:, :, None, None], cost


def _add_expected(problem: Problem, poses: Poses, parts: Equations) -> None:
    """Angles about what their take expects plus what lasts."""
    information = problem.changing[problem.take_of, :20]
    off = poses.angles.reshape(-1, 20) - problem.expected[problem.take_of] - poses.offsets[problem.take_of, :20]
    pull = information * off
    angles = np.arange(20)
    parts.H[:, 6 + angles, 6 + angles] += information
    parts.B[:, 6 + angles, angles] -= information
    parts.g[:, 6:] += pull
    parts.offsets_H[:, :20] += problem.by_take(information)
    parts.offsets_g[:, :20] -= problem.by_take(pull)
    parts.costs[:] += problem.by_take((pull * off).sum(axis=1))


def _add_coupling(problem: Problem, poses: Poses, parts: Equations) -> None:
    """DIP = ratio * PIP plus what lasts, of all digits."""
    unknowns, G = problem.shape.unknowns, parts.measures.G
    for row, ratio in enumerate(parts.measures.ratios.tolist()):
        second, last, offset, unknown = 8 + 4 * row, 9 + 4 * row, 20 + row, unknowns - 5 + row
        information = problem.changing[problem.take_of, offset]
        off = poses.angles[:, row, 3] - ratio * poses.angles[:, row, 2] - poses.offsets[problem.take_of, offset]
        pull = information * off
        by_ratio = -poses.angles[:, row, 2] * G[-5 + row, unknown]
        for i, di in ((second, -ratio), (last, 1.0)):
            parts.g[:, i] += di * pull
            parts.X[:, i, unknown] += di * information * by_ratio
            parts.B[:, i, offset] -= di * information
            for j, dj in ((second, -ratio), (last, 1.0)):
                parts.H[:, i, j] += di * dj * information
        parts.bent_X[:, second, unknown] -= pull * G[-5 + row, unknown]
        parts.person_g[unknown] += float(by_ratio @ pull)
        parts.person_H[unknown, unknown] += float((by_ratio**2) @ information)
        parts.offsets_H[:, offset] += problem.by_take(information)
        parts.offsets_g[:, offset] -= problem.by_take(pull)
        parts.offsets_X[:, offset, unknown] -= problem.by_take(information * by_ratio)
        parts.costs[:] += problem.by_take(pull * off)


def _edges(angles: Array, limits: Array) -> tuple[Array, Array, Array]:
    """Soft limits' residuals (n, 20): a rounded ramp outside; their slope and the slope's slope by the angle."""
    out_low, out_high = (limits[:, 0] - angles) / _EDGE_RAD, (angles - limits[:, 1]) / _EDGE_RAD
    scale = _EDGE_RAD / _LIMIT_RAD
    low, high = np.logaddexp(0.0, out_low), np.logaddexp(0.0, out_high)
    s_low, s_high = (1.0 / (1.0 + np.exp(-np.clip(out, -60.0, 60.0))) for out in (out_low, out_high))
    slope = (s_high - s_low) / _LIMIT_RAD
    bend = (s_high * (1.0 - s_high) + s_low * (1.0 - s_low)) / (_LIMIT_RAD * _EDGE_RAD)
    return scale * (high + low), slope, bend
