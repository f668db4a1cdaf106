"""Bundle adjustment of a person over the poses of a recording: frames, then takes are eliminated
(Schur complements), the rest is small.

Levenberg and Marquardt's method (Triggs et al. 2000, section 6). The covariance of the person is
that with all poses unknown. Data that determine nothing leave the prior, which is proper, so that
the equations are always definite; numbers so absurd that they are not end the iteration at the best
person so far.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.hand.problem import Equations, Poses, Problem, equations

# 15 to 40 on simulated recordings.
_ROUNDS = 100
_DAMPING_START, _DAMPING_DOWN, _DAMPING_UP, _DAMPING_MOST = 1e-3, 0.2, 6.0, 1e8


class Adjusted(NamedTuple):
    """The person x (p,) in prior standard deviations, covariance (p, p), the poses, the equations
    there, and rounds used.
    """

    x: Array
    covariance: Array
    poses: Poses
    found: Equations
    rounds: int


def adjust(problem: Problem, x: Array, poses: Poses) -> Adjusted:
    """The most plausible person and poses from a first guess."""
    damping, found = _DAMPING_START, equations(problem, x, poses)
    used = 0
    while used < _ROUNDS and damping < _DAMPING_MOST:
        used += 1
        try:
            dx, step, held, _ = _solved(problem, found, damping)
        except np.linalg.LinAlgError:
            damping *= _DAMPING_UP
            continue
        tried = poses.moved(step, held)
        new = equations(problem, x + dx, tried)
        if new.cost < found.cost:
            # A thousandth of a squared standard deviation is far below what any length is good for.
            done = found.cost - new.cost < 1e-3
            x, poses, found, damping = x + dx, tried, new, max(damping * _DAMPING_DOWN, 1e-9)
            if done:
                break
        else:
            damping *= _DAMPING_UP
    *_, A = _solved(problem, found, 0.0)
    return Adjusted(x, np.asarray(np.linalg.inv(A), dtype=np.float64), poses, found, used)


def _solved(
    problem: Problem, found: Equations, damping: float
) -> tuple[Array, Array, Array, Array]:
    """Step of the person (p,), the frames (n, k) and the held angles (t, 20).

    And the person's information (p, p), poses eliminated.
    """
    k, a, p = found.H.shape[1], found.H_held.shape[1], found.X.shape[2]
    H = found.H * (1.0 + damping * np.eye(k))
    # Frames: H y + B h + X x + g = 0.
    Z = np.linalg.solve(H, np.concatenate([found.B, found.X, found.g[:, :, None]], axis=2))
    Bt = np.swapaxes(found.B, 1, 2)
    takes = problem.by_take(Bt @ Z)
    S = found.H_held * (1.0 + damping * np.eye(a)) - takes[:, :, :a]
    right = np.concatenate([found.X_held, found.held_g[:, :, None]], axis=2) - takes[:, :, a:]
    V = np.linalg.solve(S, right)
    frames_X = np.einsum("nkp,nkq->pq", found.X, Z[:, :, a:])
    takes_X = np.einsum("tap,taq->pq", right[:, :, :p], V)
    A = found.H_person - frames_X[:, :p] - takes_X[:, :p]
    b = found.person_g - frames_X[:, p] - takes_X[:, p]
    A = 0.5 * (A + A.T)
    dx = -np.linalg.solve(A + damping * np.diag(np.diag(found.H_person)), b)
    held = -(V[:, :, :p] @ dx) - V[:, :, p]
    step = (
        -Z[:, :, a + p]
        - np.einsum("nkp,p->nk", Z[:, :, a : a + p], dx)
        - np.einsum("nka,na->nk", Z[:, :, :a], held[problem.take_of])
    )
    return dx, step, held, A
