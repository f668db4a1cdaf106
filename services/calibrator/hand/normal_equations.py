"""Gauss-Newton normal equations of a hand calibration, in the blocks that the Schur complements
need. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.hand.landmark_jacobian import FIRST_ANGLE, landmarks_of
from services.calibrator.hand.problem import ANGLES, WRIST, Poses, Problem, coupling_matrix

# Beyond 3 standard deviations a landmark counts linearly (Huber): fingers that were to be held
# still do twitch.
_HUBER = 3.0


class NormalEquations(NamedTuple):
    """H dz = -g in blocks: frames, constant angles of segments, hand.

    n frames, s segments, p unknowns of the hand, k = 6 + f unknowns of a frame.
    """

    cost: float  # squared standard deviations, with Huber's and all priors
    H_frame: Array  # (n, k, k)
    H_frame_constant: Array  # (n, k, 20)
    H_frame_hand: Array  # (n, k, p)
    g_frame: Array  # (n, k)
    H_constant: Array  # (s, 20, 20)
    H_constant_hand: Array  # (s, 20, p)
    g_constant: Array  # (s, 20)
    H_hand: Array  # (p, p)
    g_hand: Array  # (p,)
    distances: Array  # (n, m) whitened distance of every landmark, 0 where missing


class _Linearised(NamedTuple):
    """Errors of the landmarks in the wrist frame, and their derivatives by the unknowns."""

    error: Array  # (n, m, 3)
    by_frame: Array  # (n, m, 3, k)
    by_constant: Array  # (n, m, 3, 20)
    by_hand: Array  # (n, m, 3, p)


def normal_equations(problem: Problem, x: Array, poses: Poses) -> NormalEquations:
    """Linearise everything at the hand x (p,) and the poses."""
    linear = _linearise(problem, x, poses)
    R = poses.rotations
    turned = np.einsum("nji,nmj,njk->nmik", R, problem.weights, R)
    weights, distances, data_costs = robust_weights(turned, linear.error)
    weighted_error = np.einsum("nmij,nmj->nmi", weights, linear.error)
    by_frame, by_constant = linear.by_frame, linear.by_constant
    W_frame, W_constant, W_hand = (
        weights @ by_frame,
        weights @ by_constant,
        weights @ linear.by_hand,
    )
    flat, flat_W = (by.reshape(-1, problem.parameters.unknowns) for by in (linear.by_hand, W_hand))

    # The priors: varying angles about 0, constant ones about what the exercise asks, x about 0.
    varying_information = problem.varying_information[problem.segment_of]  # (n, f)
    varying_pull = poses.varying * varying_information
    deviation = poses.constant - problem.expected
    prior_cost = (problem.constant_information * deviation**2).sum()

    H_frame = np.einsum("nmia,nmib->nab", by_frame, W_frame)
    diagonal = np.arange(problem.max_varying) + WRIST
    H_frame[:, diagonal, diagonal] += varying_information
    g_frame = np.einsum("nmia,nmi->na", by_frame, weighted_error)
    g_frame[:, WRIST:] += varying_pull

    H_constant = problem.sum_by_segment(np.einsum("nmia,nmib->nab", by_constant, W_constant))
    H_constant[:, np.arange(ANGLES), np.arange(ANGLES)] += problem.constant_information
    g_constant = problem.sum_by_segment(np.einsum("nmia,nmi->na", by_constant, weighted_error))

    return NormalEquations(
        cost=float(data_costs.sum() + prior_cost + (poses.varying * varying_pull).sum() + x @ x),
        H_frame=H_frame,
        H_frame_constant=np.einsum("nmia,nmib->nab", by_frame, W_constant),
        H_frame_hand=np.einsum("nmia,nmib->nab", by_frame, W_hand),
        g_frame=g_frame,
        H_constant=H_constant,
        H_constant_hand=problem.sum_by_segment(np.einsum("nmia,nmib->nab", by_constant, W_hand)),
        g_constant=g_constant + problem.constant_information * deviation,
        H_hand=np.eye(len(x)) + flat.T @ flat_W,
        g_hand=x + flat.T @ weighted_error.ravel(),
        distances=distances,
    )


def _linearise(problem: Problem, x: Array, poses: Poses) -> _Linearised:
    parameters = problem.parameters
    measures = parameters.geometry(x)
    angles = problem.angles(measures, poses)
    landmarks = landmarks_of(parameters, measures, angles, parameters.table.side)
    measured = problem.points - poses.positions[:, None]
    error = landmarks.points - np.einsum("nji,nmj->nmi", poses.rotations, measured)
    by_angle = landmarks.by_pose[..., FIRST_ANGLE:]
    # A coupling ratio moves a digit's last angle by the angle before it.
    by_ratio = by_angle[..., 3::4] * angles[:, None, None, :, 2]
    by_hand = landmarks.by_measure @ measures.G
    by_hand[..., -5:] += by_ratio @ measures.G[-5:, -5:]
    by_constant = by_angle @ coupling_matrix(measures.ratios)
    by_varying = by_constant @ problem.selection[problem.segment_of][:, None]
    by_frame = np.concatenate([landmarks.by_pose[..., :FIRST_ANGLE], by_varying], axis=3)
    return _Linearised(error, by_frame, by_constant, by_hand)


def robust_weights(weights: Array, error: Array) -> tuple[Array, Array, Array]:
    """Weights (n, m, 3, 3) with Huber's factor, whitened distances (n, m) and Huber's costs (n, m).

    weights are information matrices in the frame of error (n, m, 3).
    """
    square = np.maximum(np.einsum("nmi,nmij,nmj->nm", error, weights, error), 0.0)
    distance = np.sqrt(square)
    factor = np.where(distance <= _HUBER, 1.0, _HUBER / np.maximum(distance, _HUBER))
    costs = np.where(distance <= _HUBER, square, _HUBER * (2.0 * distance - _HUBER))
    return weights * factor[:, :, None, None], distance, costs
