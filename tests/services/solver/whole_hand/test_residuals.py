"""The whole-hand problem: its gradient, and that landmarks are where the hand model has them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector
from rhot.hand import LANDMARKS, HandName
from services.solver.maths.chains import hand_chains
from services.solver.maths.rotation_vectors import apply_rotation_vector
from services.solver.whole_hand.priors.motion_prior import PosePrior
from services.solver.whole_hand.residuals import NormalEquations, Pose, normal_equations


@pytest.mark.parametrize("hand", ["right", "left"])
def test_gradient_is_the_derivative_of_the_cost(
    world: Callable, observe: Callable, hand: HandName
) -> None:
    ours = world(hand)
    chains, rng = hand_chains(ours.model), np.random.default_rng(1)
    instant = ours.motion(1, 1)[0]
    observations = observe(ours.model, ours.points(instant, LANDMARKS), 0.02)
    A = rng.normal(size=(26, 26))
    prior = PosePrior(instant.rotation, instant.position_m, instant.angles_rad, A @ A.T)
    # Small enough a turn for the prior's rotation vector to be linear.
    R, t = rotation_from_vector([1e-4, -2e-4, 1e-4]) @ instant.rotation, instant.position_m + 0.003
    q = np.clip(instant.angles_rad + rng.normal(0.0, 0.1, (5, 4)), -0.5, 1.5)
    H, g, h = np.empty((26, 26)), np.empty(26), 1e-6
    normal_equations(chains, observations, prior, Pose(R, t, q), NormalEquations(H, g))

    def cost(step: np.ndarray) -> float:
        there = Pose(apply_rotation_vector(R, step[:3]), t + step[3:6], q + step[6:].reshape(5, 4))
        unused = NormalEquations(np.empty((26, 26)), np.empty(26))
        return normal_equations(chains, observations, prior, there, unused)

    slope = np.array([(cost(h * e) - cost(-h * e)) / (2 * h) for e in np.eye(26)])
    np.testing.assert_allclose(2.0 * g, slope, rtol=1e-3, atol=1e-3 * np.abs(slope).max())
    # Of its lower triangle, as it is kept.
    assert np.linalg.eigvalsh(H, UPLO="L").min() > 0.0


@pytest.mark.parametrize("hand", ["right", "left"])
def test_every_landmark_is_where_the_hand_model_has_it(
    world: Callable, observe: Callable, hand: HandName
) -> None:
    """Seen where rhot.hand puts them, the landmarks cost nothing: each agrees to 1e-12 m."""
    ours = world(hand)
    chains, sigma_m = hand_chains(ours.model), 1e-3
    for instant in ours.motion(2, 30)[::6]:
        pose = Pose(instant.rotation, instant.position_m, instant.angles_rad)
        prior = PosePrior(*pose, np.zeros((26, 26)))
        unused = NormalEquations(np.empty((26, 26)), np.empty(26))
        for name, point in ours.points(instant, LANDMARKS).items():
            observations = observe(ours.model, {name: point}, sigma_m)
            cost = normal_equations(chains, observations, prior, pose, unused)
            assert sigma_m * np.sqrt(cost) < 1e-12
