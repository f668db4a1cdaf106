"""Poses of a known hand in many frames at once: wrist and 20 angles, each frame for itself. Pure.

Damped Gauss-Newton with a damping of each frame's own, over all frames as one batch. A landmark
that is missing in a frame has the weight 0. Frames start from several postures and turns, as the
solver's first pose does: wrist and tips of an open hand lie nearly in a plane.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array, rotation_from_vector
from services.calibrator.hand.free_motion.posture import ANGLES, Posture, posture_penalty
from services.calibrator.hand.hand_parameters import HandGeometry, HandParameters
from services.calibrator.hand.initial_poses import align
from services.calibrator.hand.landmark_jacobian import FIRST_ANGLE, POSE_UNKNOWNS, landmarks_of
from services.calibrator.hand.normal_equations import robust_weights
from services.calibrator.hand.problem import coupling_matrix

_DAMPING_START, _DAMPING_DOWN, _DAMPING_UP, _DAMPING_MAX = 1e-2, 0.2, 8.0, 1e6
# Squared standard deviations that are worth no further step.
_MIN_GAIN = 1e-3
# Postures to start from, deg: MCP and PIP of the fingers (DIP follows).
_STARTS_DEG = ((5.0, 10.0), (30.0, 40.0), (55.0, 75.0), (80.0, 100.0), (75.0, 15.0), (10.0, 95.0))
# Turns about the line to the tips and half turns about the others: every mirror image.
_TURNS = ((0.0, 0.0, 0.0), (0.0, 0.0, np.pi), (np.pi, 0.0, 0.0), (0.0, np.pi, 0.0))


Bools = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.int64] | Bools


class Frames(NamedTuple):
    """What was measured: points (n, m, 3) in the rig frame, their information (n, m, 3, 3)."""

    points: Array
    weights: Array

    def take(self, rows: Rows) -> Frames:
        """Some of the frames."""
        return Frames(self.points[rows], self.weights[rows])


class HandPoses(NamedTuple):
    """The hand in n frames: the wrist in the rig frame, and its angles in rad."""

    rotations: Array  # (n, 3, 3)
    positions: Array  # (n, 3)
    angles: Array  # (n, 20)

    def moved(self, step: Array) -> HandPoses:
        """After a step (n, 26), wrist first and in its own frame."""
        shifts = np.einsum("nij,nj->ni", self.rotations, step[:, 3:FIRST_ANGLE])
        turns = rotations_from_vectors(step[:, :3])
        return HandPoses(
            self.rotations @ turns, self.positions + shifts, self.angles + step[:, FIRST_ANGLE:]
        )

    def where(self, better: Bools, other: HandPoses) -> HandPoses:
        """The other's poses in the frames (n,) where they are better."""
        return HandPoses(
            *(
                np.where(better.reshape(-1, *(1,) * (mine.ndim - 1)), theirs, mine)
                for mine, theirs in zip(self, other, strict=True)
            )
        )


class Linear(NamedTuple):
    """The problem of each frame, linearised at its pose; squared standard deviations."""

    cost: Array  # (n,)
    H: Array  # (n, 26, 26)
    g: Array  # (n, 26)
    error: Array  # (n, m, 3) in the wrist frame
    weights: Array  # (n, m, 3, 3) in the wrist frame, with Huber's factor
    by_pose: Array  # (n, m, 3, 26)
    by_measure: Array  # (n, m, 3, measures)


class Hand(NamedTuple):
    """A hand as the kinematics want it."""

    parameters: HandParameters
    geometry: HandGeometry
    posture: Posture


def linearise(hand: Hand, frames: Frames, poses: HandPoses) -> Linear:
    """Every frame's normal equations at its pose."""
    n = len(poses.angles)
    side = hand.parameters.table.side
    M = coupling_matrix(hand.geometry.ratios)
    angles = (poses.angles @ M.T).reshape(n, 5, 4)
    landmarks = landmarks_of(hand.parameters, hand.geometry, angles, side)
    # A coupling ratio moves a digit's last angle by the angle before it.
    by_ratio = landmarks.by_pose[..., FIRST_ANGLE + 3 :: 4] * angles[:, None, None, :, 2]
    landmarks.by_measure[..., -5:] = by_ratio
    by_pose = landmarks.by_pose
    by_pose[..., FIRST_ANGLE:] = by_pose[..., FIRST_ANGLE:] @ M
    measured = frames.points - poses.positions[:, None]
    error = landmarks.points - np.einsum("nji,nmj->nmi", poses.rotations, measured)
    R = poses.rotations[:, None]
    turned = np.swapaxes(R, 2, 3) @ frames.weights @ R
    weights, _, cost = robust_weights(turned, error)
    J = by_pose.reshape(n, -1, POSE_UNKNOWNS)
    WJ = (weights @ by_pose).reshape(n, -1, POSE_UNKNOWNS)
    H = np.swapaxes(J, 1, 2) @ WJ
    g = (np.swapaxes(WJ, 1, 2) @ error.reshape(n, -1, 1))[:, :, 0]
    prior = posture_penalty(hand.posture, poses.angles, M)
    H[:, FIRST_ANGLE:, FIRST_ANGLE:] += prior.H
    g[:, FIRST_ANGLE:] += prior.gradient
    return Linear(
        cost.sum(axis=1) + prior.cost,
        H,
        g,
        error,
        weights,
        by_pose,
        landmarks.by_measure,
    )


def improved(hand: Hand, frames: Frames, poses: HandPoses, rounds: int) -> tuple[HandPoses, Linear]:
    """Poses after so many steps at most, and the problem at them; no frame becomes worse."""
    found = linearise(hand, frames, poses)
    damping = np.full(len(poses.angles), _DAMPING_START)
    for _ in range(rounds):
        diagonal = np.einsum("naa->na", found.H)
        damped = found.H + (damping[:, None] * diagonal + 1e-9)[:, :, None] * np.eye(POSE_UNKNOWNS)
        step = -np.linalg.solve(damped, found.g[:, :, None])[:, :, 0]
        trial = poses.moved(step)
        other = linearise(hand, frames, trial)
        better = other.cost < found.cost
        settled = better & (found.cost - other.cost < _MIN_GAIN)
        poses = poses.where(better, trial)
        found = Linear(
            *(
                np.where(better.reshape(-1, *(1,) * (old.ndim - 1)), new, old)
                for old, new in zip(found, other, strict=True)
            )
        )
        damping = np.where(better, damping * _DAMPING_DOWN, damping * _DAMPING_UP)
        if bool((settled | (damping > _DAMPING_MAX)).all()):
            break
    return poses, found


def first_poses(hand: Hand, frames: Frames, rounds: int) -> tuple[HandPoses, Array]:
    """The best of several starts of each frame, and its cost (n,)."""
    n = len(frames.points)
    seen = frames.weights[:, :, 0, 0] > 0.0
    weights = seen / seen.sum(axis=1, keepdims=True)
    centroid = np.einsum("nm,nmi->ni", weights, frames.points)
    best = HandPoses(np.tile(np.eye(3), (n, 1, 1)), centroid, np.zeros((n, ANGLES)))
    costs = np.full(n, np.inf)
    for mcp, pip in _STARTS_DEG:
        angles = _start_angles(hand, mcp, pip)
        tiled = np.tile(angles, (n, 1))
        every = (tiled @ coupling_matrix(hand.geometry.ratios).T).reshape(n, 5, 4)
        landmarks = landmarks_of(hand.parameters, hand.geometry, every, hand.parameters.table.side)
        R0, t0, _ = align(landmarks.points, frames.points, seen)
        for turn in _TURNS:
            R = R0 @ rotation_from_vector(turn)
            t = centroid - np.einsum("nij,nkj,nk->ni", R, R0, centroid - t0)
            poses, found = improved(hand, frames, HandPoses(R, t, tiled), rounds)
            better = found.cost < costs
            best = best.where(better, poses)
            costs = np.minimum(costs, found.cost)
    return best, costs


def _start_angles(hand: Hand, mcp_deg: float, pip_deg: float) -> Array:
    """All fingers alike, the thumb at its mean; own angles (20,) rad."""
    angles = hand.posture.mean.reshape(5, 4).copy()
    angles[1:, 1:3] = np.deg2rad([mcp_deg, pip_deg])
    return angles.ravel()


def rotations_from_vectors(vectors: Array) -> Array:
    """Rotations (n, 3, 3) of rotation vectors (n, 3) (Rodrigues)."""
    angle = np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)[:, None, None]
    K = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -z, y, -x
    K[:, 1, 0], K[:, 2, 0], K[:, 2, 1] = z, -y, x
    return np.eye(3) + np.sin(angle) / angle * K + (1.0 - np.cos(angle)) / angle**2 * (K @ K)
