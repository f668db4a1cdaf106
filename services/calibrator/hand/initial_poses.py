"""Initial poses for a hand calibration: of a few bends, the one that fits each frame best. Pure."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from services.calibrator.hand.landmark_jacobian import landmarks_of
from services.calibrator.hand.problem import Poses, Problem
from services.calibrator.hand.segments import FREE_RAD

# Tried values of a varying flexion.
_GUESSES_DEG = (5.0, 30.0, 55.0, 80.0)


def initial_poses(problem: Problem, x: Array) -> Poses:
    """Poses to begin with, for the hand x (p,).

    For each frame the varying flexion of _GUESSES_DEG whose landmarks fit it best after a rigid
    alignment.
    """
    n, f = len(problem.points), problem.max_varying
    parameters = problem.parameters
    measures, best = parameters.geometry(x), np.full(n, np.inf)
    bent = _exercised_flexions(problem)
    R, t, varying = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3)), np.zeros((n, f))
    seen = problem.weights[:, :, 0] > 0.0
    for guess in np.deg2rad(_GUESSES_DEG):
        trial = np.where(bent[problem.segment_of], guess, 0.0)
        angles = problem.angles(measures, Poses(R, t, trial, problem.expected))
        landmarks = landmarks_of(parameters, measures, angles, parameters.table.side)
        trial_R, trial_t, cost = align(landmarks.points, problem.points, seen)
        better = cost < best
        R = np.where(better[:, None, None], trial_R, R)
        t = np.where(better[:, None], trial_t, t)
        varying = np.where(better[:, None], trial, varying)
        best = np.minimum(best, cost)
    return Poses(R, t, varying, problem.expected.copy())


def _exercised_flexions(problem: Problem) -> npt.NDArray[np.bool_]:
    """Which varying angles are tried bent (s, f): only the flexion that is exercised.

    A bend of what is spread, or follows, is small.
    """
    return np.array(
        [
            [angle % 4 > 0 and sd >= FREE_RAD for angle, sd in segment.varying.items()]
            + [False] * (problem.max_varying - len(segment.varying))
            for segment in problem.segments
        ]
    )


def align(model: Array, measured: Array, seen: npt.NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Rotations (n, 3, 3) and translations (n, 3) of model points (n, m, 3) onto measured ones, and
    the mean squares that remain (n,).

    Kabsch, "A solution for the best rotation to relate two sets of vectors" (1976).
    """
    w = seen / seen.sum(axis=1, keepdims=True)
    a, b = np.einsum("nm,nmi->ni", w, model), np.einsum("nm,nmi->ni", w, measured)
    A, B = model - a[:, None], measured - b[:, None]
    U, _, V = np.linalg.svd(np.einsum("nm,nmi,nmj->nij", w, B, A))
    flip = np.ones((len(U), 3))
    flip[:, 2] = np.linalg.det(U @ V)
    R = (U * flip[:, None, :]) @ V
    cost = (w[:, :, None] * (np.einsum("nij,nmj->nmi", R, A) - B) ** 2).sum(axis=(1, 2))
    return R, b - np.einsum("nij,nj->ni", R, a), cost
