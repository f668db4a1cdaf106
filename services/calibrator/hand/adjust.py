"""Bundle adjustment of a hand's parameters over the poses of a recording. Pure.

Levenberg and Marquardt's method; frames, then segments are eliminated by Schur complements, and
what remains is small (Triggs et al. 2000, section 6). The covariance of the hand is that with all
poses unknown. Data that determine nothing leave the prior, which is proper, so that the equations
are always definite; numbers so absurd that they are not end the iteration at the best hand so far.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.hand.normal_equations import NormalEquations, normal_equations
from services.calibrator.hand.problem import Poses, Problem

# 15 to 40 on simulated recordings.
_ROUNDS = 100
_DAMPING_START, _DAMPING_DOWN, _DAMPING_UP = 1e-3, 0.2, 6.0
_DAMPING_MIN, _DAMPING_MAX = 1e-9, 1e8
# A thousandth of a squared standard deviation is far below what any length is good for.
_MIN_COST_GAIN = 1e-3


class Adjustment(NamedTuple):
    """The most plausible hand and poses."""

    x: Array  # (p,), in standard deviations of the prior
    covariance: Array  # (p, p)
    poses: Poses
    equations: NormalEquations  # at x and poses
    rounds: int


def adjust(problem: Problem, x: Array, poses: Poses) -> Adjustment:
    """The most plausible hand and poses from initial ones."""
    damping, equations = _DAMPING_START, normal_equations(problem, x, poses)
    used = 0
    while used < _ROUNDS and damping < _DAMPING_MAX:
        used += 1
        try:
            step = _solve(problem, equations, damping)
        except np.linalg.LinAlgError:
            damping *= _DAMPING_UP
            continue
        trial_x, trial_poses = x + step.hand, poses.updated(step.frames, step.constant)
        trial = normal_equations(problem, trial_x, trial_poses)
        if trial.cost < equations.cost:
            converged = equations.cost - trial.cost < _MIN_COST_GAIN
            x, poses, equations = trial_x, trial_poses, trial
            damping = max(damping * _DAMPING_DOWN, _DAMPING_MIN)
            if converged:
                break
        else:
            damping *= _DAMPING_UP
    information = _solve(problem, equations, 0.0).information
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return Adjustment(x, covariance, poses, equations, used)


class _Step(NamedTuple):
    """A damped Gauss-Newton step, and the information of the hand with poses eliminated."""

    hand: Array  # (p,)
    frames: Array  # (n, k)
    constant: Array  # (s, 20)
    information: Array  # (p, p)


def _solve(problem: Problem, found: NormalEquations, damping: float) -> _Step:
    k, a, p = found.H_frame.shape[1], found.H_constant.shape[1], found.H_frame_hand.shape[2]
    # Frames: H y + H_frame_constant h + H_frame_hand x + g = 0, solved for y.
    right_frames = np.concatenate(
        [found.H_frame_constant, found.H_frame_hand, found.g_frame[:, :, None]], axis=2
    )
    Z = np.linalg.solve(found.H_frame * (1.0 + damping * np.eye(k)), right_frames)
    eliminated = problem.sum_by_segment(np.swapaxes(found.H_frame_constant, 1, 2) @ Z)
    # Constant angles: the Schur complement S h + ... = 0, solved for h.
    S = found.H_constant * (1.0 + damping * np.eye(a)) - eliminated[:, :, :a]
    right_segments = np.concatenate([found.H_constant_hand, found.g_constant[:, :, None]], axis=2)
    right = right_segments - eliminated[:, :, a:]
    V = np.linalg.solve(S, right)
    # Hand: A x + b = 0.
    by_frames = np.einsum("nkp,nkq->pq", found.H_frame_hand, Z[:, :, a:])
    by_segments = np.einsum("tap,taq->pq", right[:, :, :p], V)
    A = found.H_hand - by_frames[:, :p] - by_segments[:, :p]
    b = found.g_hand - by_frames[:, p] - by_segments[:, p]
    A = 0.5 * (A + A.T)
    dx = -np.linalg.solve(A + damping * np.diag(np.diag(found.H_hand)), b)
    # Back substitution.
    constant = -(V[:, :, :p] @ dx) - V[:, :, p]
    frames = (
        -Z[:, :, a + p]
        - np.einsum("nkp,p->nk", Z[:, :, a : a + p], dx)
        - np.einsum("nka,na->nk", Z[:, :, :a], constant[problem.segment_of])
    )
    return _Step(dx, frames, constant, A)
