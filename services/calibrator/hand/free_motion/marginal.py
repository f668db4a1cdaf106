"""How plausible a hand is, given frames of which nobody knows the poses: a marginal likelihood.

Poses are integrated out (Laplace's approximation): -2 log p = cost at the best poses + log det H of
each frame. Taking the best poses alone makes bones too long, since a long finger, bent, explains
noise that a straight short one cannot (Neyman & Scott 1948); log det H is what it has to pay for
that. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.hand.free_motion.poses import (
    Frames,
    Hand,
    HandPoses,
    Linear,
    improved,
    linearise,
)
from services.calibrator.hand.landmark_jacobian import FIRST_ANGLE, POSE_UNKNOWNS

# Of the derivative of log det H, in standard deviations of the hand's unknowns.
_STEP = 1e-3
# So many frames count as one: what the posture prior is wrong about is the same in all. Tuning half
# (four hands of people.py, four of benchmarks/calibrate_hand.py), the solver's flexion and
# orientation errors over those with true bones, and knuckles in mm: 24: 1.27 and 1.78, 1.58 and
# 1.75, 3.1 and 3.3; 8: 1.23 and 1.52, 1.53 and 1.55, 2.9 and 3.7.
ALIKE = 8.0
# The same for how sure the hand is told to be: errors of knuckles over their sigmas, tuning half
# (three hands, two mixes of scenes), were 1.0 and 1.4 at 16, .9 and 1.15 at 40.
ALIKE_TOLD = 24.0


class Plausibility(NamedTuple):
    """A hand with the poses that go with it."""

    cost: float  # -2 log of the posterior, but for a constant
    poses: HandPoses
    linear: Linear


class HandEquations(NamedTuple):
    """A dx = -b of the hand's unknowns, poses eliminated; A is also its information."""

    A: Array  # (p, p)
    b: Array  # (p,)
    follow: Array  # (n, 26, p) how poses move with the hand


def plausibility(
    hand: Hand, x: Array, frames: Frames, poses: HandPoses, rounds: int
) -> Plausibility:
    """Of the unknowns x (p + 20,) that hand stands for, from poses near its best ones."""
    found, linear = improved(hand, frames, poses, rounds)
    log_det = float(np.linalg.slogdet(linear.H)[1].sum())
    return Plausibility(float(linear.cost.sum()) + log_det + ALIKE * float(x @ x), found, linear)


def hand_equations(hand: Hand, x: Array, frames: Frames, at: Plausibility) -> HandEquations:
    """Gauss-Newton's, with the derivative of log det H in b."""
    linear, p, total = at.linear, hand.parameters.unknowns, len(x)
    n = len(linear.cost)
    by_hand = (linear.by_measure @ hand.geometry.G).reshape(n, -1, p)
    W_hand = (linear.weights @ by_hand.reshape(n, -1, 3, p)).reshape(n, -1, p)
    J = linear.by_pose.reshape(n, by_hand.shape[1], -1)
    # The mean posture: the prior's residual is angles - mean.
    pull = hand.posture.information * hand.posture.mean_sd  # (20, 20), by the mean's unknowns
    H_hand = np.zeros((n, POSE_UNKNOWNS, total))
    H_hand[:, :, :p] = np.swapaxes(J, 1, 2) @ W_hand
    H_hand[:, FIRST_ANGLE:, p:] = -pull
    follow: Array = -np.asarray(np.linalg.solve(linear.H, H_hand), dtype=np.float64)
    A, b = ALIKE * np.eye(total), ALIKE * x
    flat, flat_W = by_hand.reshape(-1, p), W_hand.reshape(-1, p)
    A[:p, :p] += flat.T @ flat_W
    A[p:, p:] += n * hand.posture.mean_sd[:, None] * pull
    A += np.einsum("nap,naq->pq", H_hand, follow)
    b[:p] += flat_W.T @ linear.error.ravel()
    b[p:] -= pull.T @ (at.poses.angles - hand.posture.mean).sum(axis=0)
    b += np.einsum("nap,na->p", follow, linear.g)
    b += 0.5 * _log_det_gradient(hand, x, frames, at, follow)
    return HandEquations(0.5 * (A + A.T), b, follow)


def _log_det_gradient(
    hand: Hand, x: Array, frames: Frames, at: Plausibility, follow: Array
) -> Array:
    """Derivative of the sum of log det H by each of the unknowns, poses following; (p + 20,)."""
    inverse = np.linalg.inv(at.linear.H)
    gradient = np.zeros(len(x))
    for k in range(len(x)):
        other = hand
        if k < hand.parameters.unknowns:
            moved = x[: hand.parameters.unknowns].copy()
            moved[k] += _STEP
            other = hand._replace(geometry=hand.parameters.geometry(moved))
        H = linearise(other, frames, at.poses.moved(_STEP * follow[:, :, k])).H
        gradient[k] = float(np.einsum("nab,nba->", inverse, H - at.linear.H)) / _STEP
    return gradient
