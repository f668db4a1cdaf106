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
# Habits of a person: how steadily angles are kept from take to take (abduction and first flexion of the fingers, second flexion of
# the fingers, the thumb, the couplings) and how true the couplings are within a take; then per take and digit how still it is held.
_LASTING_HABITS = np.array([2, 2, 2, -1, *(0, 0, 1, -1) * 4, *(3,) * 5])
_CHANGING_COUPLING, _HABITS = 4, 5
_LAST_JOINT = np.arange(20) % 4 == 3
# Standard deviation of a habit's logarithm: a factor of two. More than e^4 is never meant.
HABIT_SD, _HABIT_MOST = float(np.log(2.0)), 4.0 / float(np.log(2.0))
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
    """What was seen, points (n, m, 3) in the rig frame and weights 1/sigma^2 (n, m, 3), 0 where missing; and what is expected.

    The unknowns of a calibration are the person's, then the habits: logarithms of how the standard deviations above differ from
    what was expected, in units of their own prior.
    """

    def __init__(self, shape: Shape, points: Array, weights: Array, takes: tuple[Take, ...], limits: Array) -> None:
        self.shape, self.points, self.weights, self.takes, self.limits = shape, points, weights, takes, limits
        counts = [take.count for take in takes]
        self.counts = np.array(counts)
        self.take_of = np.repeat(np.arange(len(takes)), counts)
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        self.free = np.array([take.free for take in takes])
        self.expected = np.array([take.expected for take in takes])
        # 1/sd^2 of what lasts and what changes (takes, 25); of a coupling's deviation nothing is expected.
        self._lasting = np.array([[*take.lasting**-2.0, *(_COUPLING_RAD[0] ** -2.0,) * 5] for take in takes])
        self._changing = np.array([[*take.changing**-2.0, *(_COUPLING_RAD[1] ** -2.0,) * 5] for take in takes])
        # Which habit scales which of them: its index, or -1.
        self.lasting_habit = np.tile(_LASTING_HABITS, (len(takes), 1))
        own = _HABITS + 5 * np.arange(len(takes))[:, None] + np.arange(20) // 4
        self.changing_habit = np.concatenate([np.where(self.free | _LAST_JOINT, -1, own), np.full((len(takes), 5), _CHANGING_COUPLING)], axis=1)
        self.unknowns = shape.unknowns + _HABITS + 5 * len(takes)

    def by_take(self, values: Array) -> Array:
        """Sums over the frames of each take; (n, ...) -> (takes, ...)."""
        return np.add.reduceat(values, self.first, axis=0)

    def informations(self, x: Array) -> tuple[Array, Array]:
        """1/sd^2 of what lasts and of what changes in each take, (takes, 25) both, under the habits of x (unknowns,)."""
        factor = np.exp(-2.0 * HABIT_SD * np.clip(np.append(x[self.shape.unknowns :], 0.0), -_HABIT_MOST, _HABIT_MOST))
        return self._lasting * factor[self.lasting_habit], self._changing * factor[self.changing_habit]


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
    informations: tuple[Array, Array]  # 1/sd^2 of what lasts and what changes, (t, 25) each


def equations(problem: Problem, x: Array, poses: Poses) -> Equations:
    """Linearise everything."""
    shape = problem.shape
    person = shape.unknowns
    measures = shape.geometry(x[:person])
    marks = marks_of(shape, measures, poses.angles, shape.table.side)
    error, weights, cost = _errors(problem, marks, poses)
    pull = np.einsum("nmij,nmj->nmi", weights, error)
    Jx = marks.by_measure @ measures.G
    WJ = weights @ marks.J
    H = np.einsum("nmia,nmib->nab", WJ, marks.J)
    X = np.einsum("nmia,nmib->nab", WJ, Jx)
    g = np.einsum("nmia,nmi->na", marks.J, pull)
    person_H, person_g = np.eye(problem.unknowns), x.copy()
    person_H[:person, :person] += np.einsum("nmia,nmib->ab", weights @ Jx, Jx)
    person_g[:person] += np.einsum("nmia,nmi->a", Jx, pull)
    bent, mixed = curved(shape, marks, pull)
    bent_X = _wide(mixed @ measures.G, problem.unknowns)
    lasting, changing = problem.informations(x)
    residual, slope, bend = _edges(poses.angles.reshape(-1, 20), problem.limits.reshape(20, 2))
    cost += (residual**2).sum(axis=1)
    diagonal = np.arange(6, UNKNOWNS)
    g[:, 6:] += slope * residual
    H[:, diagonal, diagonal] += slope**2
    bent[:, diagonal, diagonal] += bend * residual
    parts = Equations(
        costs=problem.by_take(cost) + (poses.offsets**2 * lasting).sum(axis=1),
        H=H,
        B=np.zeros((len(H), UNKNOWNS, OFFSETS)),
        X=_wide(X, problem.unknowns),
        g=g,
        offsets_H=lasting.copy(),
        offsets_X=np.zeros((len(problem.takes), OFFSETS, problem.unknowns)),
        offsets_g=lasting * poses.offsets,
        person_H=person_H,
        person_g=person_g,
        bent=bent,
        bent_X=bent_X,
        measures=measures,
        marks=marks,
        weights=weights,
        edges=(slope, bend),
        informations=(lasting, changing),
    )
    changes = np.zeros((len(H), OFFSETS))
    _add_expected(problem, poses, parts, changes)
    _add_coupling(problem, poses, parts, changes)
    _add_habits(problem, poses, parts, changes)
    return parts


def _wide(by_person: Array, unknowns: int) -> Array:
    """Room for the habits' columns."""
    return np.concatenate([by_person, np.zeros((*by_person.shape[:-1], unknowns - by_person.shape[-1]))], axis=-1)


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


def _add_expected(problem: Problem, poses: Poses, parts: Equations, changes: Array) -> None:
    """Angles about what their take expects plus what lasts; fills changes[:, :20] with what is left."""
    information = parts.informations[1][problem.take_of, :20]
    off = poses.angles.reshape(-1, 20) - problem.expected[problem.take_of] - poses.offsets[problem.take_of, :20]
    changes[:, :20] = off
    pull = information * off
    angles = np.arange(20)
    parts.H[:, 6 + angles, 6 + angles] += information
    parts.B[:, 6 + angles, angles] -= information
    parts.g[:, 6:] += pull
    parts.offsets_H[:, :20] += problem.by_take(information)
    parts.offsets_g[:, :20] -= problem.by_take(pull)
    parts.costs[:] += problem.by_take((pull * off).sum(axis=1))


def _add_coupling(problem: Problem, poses: Poses, parts: Equations, changes: Array) -> None:
    """DIP = ratio * PIP plus what lasts, of all digits; fills changes[:, 20:] with what is left."""
    person, G = problem.shape.unknowns, parts.measures.G
    for row, ratio in enumerate(parts.measures.ratios.tolist()):
        second, last, offset, unknown = 8 + 4 * row, 9 + 4 * row, 20 + row, person - 5 + row
        information = parts.informations[1][problem.take_of, offset]
        off = poses.angles[:, row, 3] - ratio * poses.angles[:, row, 2] - poses.offsets[problem.take_of, offset]
        changes[:, offset] = off
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


def _add_habits(problem: Problem, poses: Poses, parts: Equations, changes: Array) -> None:
    """What the habits change: the weights of all that lasts and changes, and the price of a wide deviation (its log)."""
    lasting, changing = parts.informations
    person = problem.shape.unknowns
    for take, rows in enumerate(np.split(np.arange(len(changes)), problem.first[1:])):
        for a in range(OFFSETS):
            h = problem.lasting_habit[take, a]
            if h >= 0:
                pull = lasting[take, a] * poses.offsets[take, a]
                parts.offsets_X[take, a, person + h] -= 2.0 * HABIT_SD * pull
                parts.person_g[person + h] += HABIT_SD * (1.0 - pull * poses.offsets[take, a])
                parts.person_H[person + h, person + h] += 2.0 * HABIT_SD**2
                parts.costs[take] -= np.log(lasting[take, a])
            h = problem.changing_habit[take, a]
            if h >= 0:
                pulls = changing[take, a] * changes[rows, a]
                parts.offsets_X[take, a, person + h] += 2.0 * HABIT_SD * float(pulls.sum())
                parts.person_g[person + h] += HABIT_SD * (len(rows) - float(pulls @ changes[rows, a]))
                parts.person_H[person + h, person + h] += 2.0 * HABIT_SD**2 * len(rows)
                parts.costs[take] -= len(rows) * np.log(changing[take, a])
                if a < 20:
                    parts.X[rows, 6 + a, person + h] -= 2.0 * HABIT_SD * pulls
                else:
                    second, last = 8 + 4 * (a - 20), 9 + 4 * (a - 20)
                    parts.X[rows, last, person + h] -= 2.0 * HABIT_SD * pulls
                    parts.X[rows, second, person + h] += 2.0 * HABIT_SD * pulls * parts.measures.ratios[a - 20]


def _edges(angles: Array, limits: Array) -> tuple[Array, Array, Array]:
    """Soft limits' residuals (n, 20): a rounded ramp outside; their slope and the slope's slope by the angle."""
    out_low, out_high = (limits[:, 0] - angles) / _EDGE_RAD, (angles - limits[:, 1]) / _EDGE_RAD
    scale = _EDGE_RAD / _LIMIT_RAD
    low, high = np.logaddexp(0.0, out_low), np.logaddexp(0.0, out_high)
    s_low, s_high = (1.0 / (1.0 + np.exp(-np.clip(out, -60.0, 60.0))) for out in (out_low, out_high))
    slope = (s_high - s_low) / _LIMIT_RAD
    bend = (s_high * (1.0 - s_high) + s_low * (1.0 - s_low)) / (_LIMIT_RAD * _EDGE_RAD)
    return scale * (high + low), slope, bend
