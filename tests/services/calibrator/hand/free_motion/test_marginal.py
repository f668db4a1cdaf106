"""Derivatives of the marginal likelihood, by finite differences."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import default_hand
from services.calibrator.hand.free_motion.frames import seen_frames
from services.calibrator.hand.free_motion.marginal import hand_equations, plausibility
from services.calibrator.hand.free_motion.poses import Hand, first_poses
from services.calibrator.hand.free_motion.posture import ANGLES, posture_of
from services.calibrator.hand.hand_parameters import HandParameters


def test_the_gradient(other_hand, random_motion) -> None:
    truth = other_hand("right", (1.0, 1.05, 0.95, 1.0, 1.0))
    table = default_hand("right")
    seen = seen_frames([message for message, _ in random_motion(truth, 600, 2)], table)
    parameters, posture = HandParameters(table, seen.names), posture_of(table)
    p = parameters.unknowns

    def hand(x: Array) -> Hand:
        mean = posture.mean + posture.mean_sd * x[p:]
        return Hand(parameters, parameters.geometry(x[:p]), posture._replace(mean=mean))

    x = np.zeros(p + ANGLES)
    poses, costs = first_poses(hand(x), seen.frames, 4)
    good = seen.frames.take(costs < np.median(costs))
    poses = type(poses)(*(part[costs < np.median(costs)] for part in poses))
    at = plausibility(hand(x), x, good, poses, 300)
    equations = hand_equations(hand(x), x, good, at)
    # Size, two bones, a base, a direction, paint, coupling, a mean angle.
    for k in (0, 4, 5, 22, 33, 46, p - 3, p + 5):
        costs = []
        for step in (1e-3, -1e-3):
            other = x.copy()
            other[k] += step
            moved = at.poses.moved(step * equations.follow[:, :, k])
            costs.append(plausibility(hand(other), other, good, moved, 100).cost)
        # Half the cost's derivative; Gauss-Newton's matrices leave second derivatives out.
        assert abs(0.25 * (costs[0] - costs[1]) / 1e-3 - equations.b[k]) < 0.5 + 0.1 * abs(
            equations.b[k]
        )
