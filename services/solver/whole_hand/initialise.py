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

from rhot.geometry.transforms import Array, rotation_from_vector
from services.solver.maths.chains import HandChains
from services.solver.whole_hand.fit import fit
from services.solver.whole_hand.landmarks import Observations, frames_in_wrist
from services.solver.whole_hand.motion_prior import UNKNOWNS, PosePrior
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
# Rotation vectors (rad): turns about the line from the wrist to the tips, and half turns about the
# others: every start that could be a mirror image.
_TURNS = (
    (0.0, 0.0, 0.0),
    (0.0, 0.0, np.pi),
    (0.0, 0.0, np.pi / 2),
    (0.0, 0.0, -np.pi / 2),
    (np.pi, 0.0, 0.0),
    (0.0, np.pi, 0.0),
)
# Iterations to sort the hypotheses, and to finish the best few.
_COARSE_ITERATIONS, _FINE_ITERATIONS, _FINISHED = 6, 60, 4


class Hypothesis(NamedTuple):
    """One possible first pose."""

    cost: float  # sum of squares in standard deviations
    pose: Pose
    information: Array  # (26, 26)


def initialise(
    chains: HandChains, prior: PosePrior, observations: Observations
) -> list[Hypothesis]:
    """Poses for landmarks when nothing is known of the wrist, best first.

    Some may be the same. Deterministic; about 3 ms.
    """
    found = []
    centroid = observations.point_m.mean(axis=0)  # (3,)
    for angles in initial_postures(chains):
        R0, t0 = _align(chains, observations, angles)
        for turn in _TURNS:
            R = R0 @ rotation_from_vector(turn)
            t = centroid - R @ R0.T @ (centroid - t0)
            start = Hypothesis(np.inf, Pose(R, t, angles.copy()), np.empty((UNKNOWNS, UNKNOWNS)))
            found.append(_improved(chains, prior, observations, start, _COARSE_ITERATIONS))
    found.sort(key=lambda hypothesis: hypothesis.cost)
    finished = [
        _improved(chains, prior, observations, hypothesis, _FINE_ITERATIONS)
        for hypothesis in found[:_FINISHED]
    ]
    return sorted(finished, key=lambda hypothesis: hypothesis.cost)


def initial_postures(chains: HandChains) -> list[Array]:
    """The postures to start from, within a person's limits; each (5, 4) rad."""
    result = []
    for (mcp, pip), thumb in _POSTURES_DEG:
        angles = np.deg2rad(np.array([(5.0, *thumb), *((0.0, mcp, pip, 2.0 / 3.0 * pip),) * 4]))
        result.append(np.clip(angles, chains.limits_rad[:, :, 0], chains.limits_rad[:, :, 1]))
    return result


def _improved(
    chains: HandChains,
    prior: PosePrior,
    observations: Observations,
    start: Hypothesis,
    max_iterations: int,
) -> Hypothesis:
    """A hypothesis after some iterations; its arrays are changed in place."""
    cost, _ = fit(chains, observations, prior, start.pose, max_iterations, start.information)
    return start._replace(cost=cost)


def _align(chains: HandChains, observations: Observations, angles: Array) -> tuple[Array, Array]:
    """Rotation and position that align the posture's landmarks with the observed ones.

    Kabsch 1976, weights 1.
    """
    positions, rotations = frames_in_wrist(chains, angles)
    where = zip(
        observations.joint.tolist(),
        observations.digit.tolist(),
        observations.offset_m,
        strict=True,
    )
    model = np.array(
        [
            offset if digit < 0 else positions[joint] + rotations[joint] @ offset
            for joint, digit, offset in where
        ]
    )  # (m, 3) wrist frame
    centre, seen = model.mean(axis=0), observations.point_m.mean(axis=0)
    U, _, Vt = np.linalg.svd((observations.point_m - seen).T @ (model - centre))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return R, seen - R @ centre
