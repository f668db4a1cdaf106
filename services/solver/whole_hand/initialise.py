"""The first pose of a hand of which nothing is known: the best of several hypotheses.

Some postures (open, relaxed, fist, point, pinch, ...) are aligned with the landmarks rigidly
(Kabsch 1976, never mirrored), then turned about the line from wrist to finger tips and flipped, and
each of these hypotheses is improved by fit.py; the cheapest wins. Wrist and tips lie nearly in a
plane on an open hand, so that one start alone can end with the palm on the wrong side: RHOT's
landmarks cannot tell otherwise than by the order of the fingers and the limits of their joints.
Landmarks that are all in one place give a pose with a large cost, no error.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array, rotation_from_vector
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import HandChains
from services.solver.maths.kinematics import hand_frames
from services.solver.whole_hand.fit import fit
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS, PosePrior
from services.solver.whole_hand.residuals import Pose

# Postures in degrees: flexions of fingers (MCP, PIP; DIP follows) and of the thumb (CMC, MCP, IP).
_POSTURES_DEG = (
    ((5.0, 10.0), (0.0, 10.0, 10.0)),
    ((30.0, 40.0), (5.0, 20.0, 20.0)),
    ((55.0, 75.0), (10.0, 30.0, 30.0)),
    ((80.0, 100.0), (20.0, 40.0, 50.0)),
    ((75.0, 15.0), (10.0, 20.0, 20.0)),
    ((10.0, 95.0), (10.0, 30.0, 40.0)),
)
# Turns about the line from the wrist to the tips, and half turns about the others: every start that
# could be a mirror image.
_TURNS = np.array(
    [
        rotation_from_vector(turn)
        for turn in (
            (0.0, 0.0, 0.0),
            (0.0, 0.0, np.pi),
            (0.0, 0.0, np.pi / 2),
            (0.0, 0.0, -np.pi / 2),
            (np.pi, 0.0, 0.0),
            (0.0, np.pi, 0.0),
        )
    ]
)
# Iterations of a round, and how many hypotheses go on from it, the best so far: most starts are far
# from any good pose, as two iterations show. With 6 iterations of each and no choice before, the
# poses were the same for 599 of 599 random hands (of other sizes than the model's, landmarks
# missing, 1 to 5 mm of noise) and 80 of Leap recordings, in 1.6 times the time.
_ROUNDS = ((2, 12), (4, 4), (60, 4))


class Hypothesis(NamedTuple):
    """One possible first pose."""

    cost: float  # sum of squares in standard deviations
    pose: Pose
    information: Array  # (26, 26)


class _Starts(NamedTuple):
    """n hypotheses; arrays are written in place."""

    rotation: Array  # (n, 3, 3)
    position_m: Array  # (n, 3)
    angles: Array  # (n, 5, 4)
    cost: Array  # (n,)
    information: Array  # (n, 26, 26)


def initialise(
    chains: HandChains, prior: PosePrior, observations: Observations
) -> list[Hypothesis]:
    """Poses for landmarks when nothing is known of the wrist, best first.

    Some may be the same. Deterministic; 1 to 2 ms.
    """
    postures = initial_postures(chains)
    n = len(postures) * len(_TURNS)
    found = _Starts(
        rotation=np.empty((n, 3, 3)),
        position_m=np.empty((n, 3)),
        angles=np.repeat(postures, len(_TURNS), axis=0),
        cost=np.empty(n),
        information=np.empty((n, UNKNOWNS, UNKNOWNS)),
    )
    _place(chains, observations, _TURNS, found)
    best = np.arange(n)
    for iterations, number in _ROUNDS:
        _improve(chains, observations, prior, found, best, iterations)
        best = best[np.argsort(found.cost[best], kind="stable")][:number]
    return [
        Hypothesis(
            float(found.cost[k]),
            Pose(found.rotation[k], found.position_m[k], found.angles[k]),
            found.information[k],
        )
        for k in best.tolist()
    ]


def initial_postures(chains: HandChains) -> Array:
    """The postures to start from, within a person's limits; (n, 5, 4) rad."""
    degrees = [
        [(5.0, *thumb), *((0.0, mcp, pip, 2.0 / 3.0 * pip),) * 4]
        for (mcp, pip), thumb in _POSTURES_DEG
    ]
    return np.clip(np.deg2rad(degrees), chains.limits_rad[..., 0], chains.limits_rad[..., 1])


@njit(cache=True)
def _improve(
    chains: HandChains,
    observations: Observations,
    prior: PosePrior,
    found: _Starts,
    which: Integers,
    max_iterations: int,
) -> None:
    """Some hypotheses (k,) after some iterations more."""
    for k in which:
        pose = Pose(found.rotation[k], found.position_m[k], found.angles[k])
        information = found.information[k]
        found.cost[k], _ = fit(chains, observations, prior, pose, max_iterations, information)


@njit(cache=True)
def _place(chains: HandChains, observations: Observations, turns: Array, found: _Starts) -> None:
    """Wrists for the postures of found, whose angles are given: each posture is aligned with the
    landmarks and then turned about their centroid, by each of turns (t, 3, 3).
    """
    seen = observations.point_m.sum(axis=0) / len(observations.point_m)
    model = np.empty_like(observations.point_m)  # (m, 3) wrist frame
    positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
    for n in range(0, len(found.cost), len(turns)):
        hand_frames(chains, np.eye(3), np.zeros(3), found.angles[n], positions, rotations)
        for m in range(len(model)):
            joint, offset_m = observations.joint[m], observations.offset_m[m]
            model[m] = offset_m
            if observations.digit[m] >= 0:
                model[m] = positions[joint] + rotations[joint] @ offset_m
        centre = model.sum(axis=0) / len(model)
        R0 = _aligning(model - centre, observations.point_m - seen)
        for k in range(len(turns)):
            R = R0 @ turns[k]
            found.rotation[n + k] = R
            found.position_m[n + k] = seen - R @ centre


@njit(cache=True)
def _aligning(model: Array, seen: Array) -> Array:
    """The rotation that aligns points (m, 3) about their centroid with others; Kabsch 1976."""
    U, _, Vt = np.linalg.svd(seen.T @ model)
    U[:, 2] *= np.sign(np.linalg.det(U @ Vt))
    return U @ Vt
