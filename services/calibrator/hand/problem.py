"""One calibration as a least-squares problem: landmarks of many frames, a few takes, one person.

A take is some seconds of one exercise: one digit (or one joint of all) moves, the others are held.
What is held has one angle per take, what moves one per frame, and every last joint follows its
neighbour by the person's ratio plus what lasts for the take. So few unknowns per frame leave no
room for the flaw of adjusting everything at once: with twenty free angles a frame a long finger,
bent, explains noise that a short one, straight, cannot, and bones come out a tenth too long (Neyman
& Scott 1948 on many nuisances). A landmark that is missing in a frame has the weight 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector
from services.calibrator.hand.hand_parameters import Geometry, Shape
from services.calibrator.hand.landmark_jacobian import marks_of

# Angles per digit and in all; the unknowns of a wrist.
ANGLES, _WRIST = 20, 6
# A joint that may change by more has no part that is held: where it is in one frame says nothing of
# the next.
_FREE_RAD = np.deg2rad(30.0)
# Beyond 3 standard deviations a landmark counts linearly (Huber): fingers that were to be held do
# twitch.
_HUBER = 3.0


@dataclass(frozen=True)
class Take:
    """Frames of one exercise. moving: angles (0..19) that change, and by how much (sd, rad);
    expected, sd (20,) rad: what is held.

    Of a last joint (index % 4 == 3) expected and sd are those of its deviation from ratio * the
    joint before it.
    """

    name: str
    count: int
    moving: dict[int, float]
    expected: Array
    sd: Array


class Poses(NamedTuple):
    """The hand in every frame: wrist in the rig frame, moving angles (padded with zeros), and the
    held angles of every take.
    """

    rotations: Array  # (n, 3, 3)
    positions: Array  # (n, 3)
    moving: Array  # (n, f)
    held: Array  # (takes, 20)

    def moved(self, step: Array, held: Array) -> Poses:
        """After a step (n, 6 + f), wrist first and in its own frame, and one of the held angles
        (takes, 20).
        """
        turns = np.array([rotation_from_vector(v) for v in step[:, :3]])
        shifts = np.einsum("nij,nj->ni", self.rotations, step[:, 3:_WRIST])
        return Poses(
            self.rotations @ turns,
            self.positions + shifts,
            self.moving + step[:, _WRIST:],
            self.held + held,
        )


class Problem:
    """What was seen: points (n, m, 3) in the rig frame, weights 1/sigma^2 (n, m, 3), 0 where
    missing; frames in the order of takes.
    """

    def __init__(
        self, shape: Shape, points: Array, weights: Array, takes: tuple[Take, ...]
    ) -> None:
        self.shape, self.points, self.weights, self.takes = shape, points, weights, takes
        counts = [take.count for take in takes]
        self.take_of = np.repeat(np.arange(len(takes)), counts)
        self._first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        self.most = max(len(take.moving) for take in takes)
        self.unknowns = shape.unknowns
        # Which angle each moving unknown of a take is, as a matrix (takes, 20, f); columns beyond a
        # take's own are zero.
        self.picks = np.zeros((len(takes), ANGLES, self.most))
        self.spare = np.ones((len(takes), self.most), dtype=bool)
        # 1/sd^2 of the moving unknowns; a spare column is nobody's: its equation says that it stays
        # zero.
        self.moving_information = np.ones((len(takes), self.most))
        for t, take in enumerate(takes):
            self.picks[t, list(take.moving), np.arange(len(take.moving))] = 1.0
            self.spare[t, : len(take.moving)] = False
            self.moving_information[t, : len(take.moving)] = (
                np.array(list(take.moving.values())) ** -2.0
            )
        self.expected = np.array([take.expected for take in takes])
        held = np.array(
            [[take.moving.get(angle, 0.0) < _FREE_RAD for angle in range(ANGLES)] for take in takes]
        )
        self.held_information = np.where(held, np.array([take.sd for take in takes]) ** -2.0, 1e12)
        self.expected = np.where(held, self.expected, 0.0)

    def by_take(self, values: Array) -> Array:
        """Sums over the frames of each take; (n, ...) -> (takes, ...)."""
        return np.add.reduceat(values, self._first, axis=0)

    def angles(self, measures: Geometry, poses: Poses) -> Array:
        """All angles, (n, 5, 4)."""
        own = poses.held[self.take_of] + np.einsum(
            "naf,nf->na", self.picks[self.take_of], poses.moving
        )
        return (own @ coupled(measures.ratios).T).reshape(-1, 5, 4)


class Equations(NamedTuple):
    """Gauss and Newton's normal equations.

    N frames, t takes, p unknowns of the person, k = 6 + f of a frame.
    """

    cost: float  # squared standard deviations, with Huber's and all priors
    H: Array  # (n, k, k)
    B: Array  # (n, k, 20) with the take's held angles
    X: Array  # (n, k, p) with the person
    g: Array  # (n, k)
    H_held: Array  # (t, 20, 20)
    X_held: Array  # (t, 20, p)
    held_g: Array  # (t, 20)
    H_person: Array  # (p, p)
    person_g: Array  # (p,)
    distances: Array  # (n, m) whitened distance of every landmark, 0 where missing


def coupled(ratios: Array) -> Array:
    """All angles from the unknown ones: the last of a digit is ratio times the one before plus its
    own; (20, 20).
    """
    M = np.eye(ANGLES)
    last = 4 * np.arange(5) + 3
    M[last, last - 1] = ratios
    return M


def equations(problem: Problem, x: Array, poses: Poses) -> Equations:
    """Linearise everything at the person x (p,) and the poses."""
    shape = problem.shape
    measures = shape.geometry(x)
    angles = problem.angles(measures, poses)
    marks = marks_of(shape, measures, angles, shape.table.side)
    R, take_of = poses.rotations, problem.take_of
    error = marks.points - np.einsum("nji,nmj->nmi", R, problem.points - poses.positions[:, None])
    weights, distances, cost = _weighed(problem, error, R)
    by_angle = marks.J[..., _WRIST:]
    of_ratios = by_angle[..., 3::4] * angles[:, None, None, :, 2]
    by_person = marks.by_measure @ measures.G
    by_person[..., -5:] += of_ratios @ measures.G[-5:, -5:]
    by_held = by_angle @ coupled(measures.ratios)
    own = np.concatenate([marks.J[..., :_WRIST], by_held @ problem.picks[take_of][:, None]], axis=3)
    W_own, W_held, W_person = weights @ own, weights @ by_held, weights @ by_person
    H = np.einsum("nmia,nmib->nab", own, W_own)
    pull = np.einsum("nmij,nmj->nmi", weights, error)
    off, loose = poses.held - problem.expected, poses.moving * problem.moving_information[take_of]
    k = np.arange(problem.most) + _WRIST
    H[:, k, k] += problem.moving_information[take_of]
    g = np.einsum("nmia,nmi->na", own, pull)
    g[:, _WRIST:] += loose
    H_held = problem.by_take(np.einsum("nmia,nmib->nab", by_held, W_held))
    H_held[:, np.arange(ANGLES), np.arange(ANGLES)] += problem.held_information
    flat = by_person.reshape(-1, shape.unknowns)
    return Equations(
        cost=float(
            cost + (problem.held_information * off**2).sum() + (poses.moving * loose).sum() + x @ x
        ),
        H=H,
        B=np.einsum("nmia,nmib->nab", own, W_held),
        X=np.einsum("nmia,nmib->nab", own, W_person),
        g=g,
        H_held=H_held,
        X_held=problem.by_take(np.einsum("nmia,nmib->nab", by_held, W_person)),
        held_g=problem.by_take(np.einsum("nmia,nmi->na", by_held, pull))
        + problem.held_information * off,
        H_person=np.eye(len(x)) + flat.T @ W_person.reshape(-1, shape.unknowns),
        person_g=x + flat.T @ pull.ravel(),
        distances=distances,
    )


def _weighed(problem: Problem, error: Array, R: Array) -> tuple[Array, Array, float]:
    """Weights (n, m, 3, 3) in the wrist frame with Huber's factor, whitened distances (n, m), the
    sum of Huber's costs.
    """
    weights = np.einsum("nji,nmj,njk->nmik", R, problem.weights, R)
    square = np.maximum(np.einsum("nmi,nmij,nmj->nm", error, weights, error), 0.0)
    distance = np.sqrt(square)
    factor = np.where(distance <= _HUBER, 1.0, _HUBER / np.maximum(distance, _HUBER))
    cost = float(np.where(distance <= _HUBER, square, _HUBER * (2.0 * distance - _HUBER)).sum())
    return weights * factor[:, :, None, None], distance, cost
