"""Normal equations of one digit: against the geometric Jacobian, and by finite differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector, rotation_y
from rhot.hand import default_hand
from services.solver.finger.dls_equations import (
    COUPLED,
    COUPLING_WEIGHT,
    POSE,
    POSITION,
    Problem,
    normal_equations,
    rotation_error,
)
from services.solver.maths.chains import digit_chain, hand_chains
from services.solver.maths.kinematics import tip_jacobian, tip_position, tip_rotation

CHAIN = digit_chain(hand_chains(default_hand()), 1)._replace(
    lengths=np.array([0.45, 0.25, 0.3]), tool=np.array([0.02, -0.03, -0.25])
)


def _problem(rng: np.random.Generator, kind: int, prior_weight: float = 0.0) -> Problem:
    return Problem(
        kind=kind,
        bones=np.array([CHAIN.lengths, CHAIN.tool]),
        limits=CHAIN.limits,
        coupling=CHAIN.coupling,
        point=rng.uniform(-0.8, 0.8, 3),
        rotation=np.eye(3),
        prior=np.array([rng.uniform(-1.0, 1.0, 4), prior_weight * rng.uniform(0.1, 1.0, 4)]),
    )


def _random_turn(rng: np.random.Generator) -> np.ndarray:
    """A rotation vector of up to 170 deg: at 180 its direction cannot be told."""
    axis = rng.normal(size=3)
    return rng.uniform(0.0, np.deg2rad(170.0)) * axis / np.linalg.norm(axis)


def _evaluate(problem: Problem, q: np.ndarray) -> tuple[float, float, np.ndarray, np.ndarray]:
    H, g = np.empty((4, 4)), np.empty(4)
    cost, distance = normal_equations(problem, q, H, g)
    return cost, distance, H, g


def test_position_agrees_with_the_geometric_jacobian(within: Callable) -> None:
    """The equations repeat the kinematics; they must be those of kinematics.py to 1e-12."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        problem, q = _problem(rng, POSITION), within(rng, CHAIN.limits, False)
        cost, distance, H, g = _evaluate(problem, q)
        p, J = np.empty(3), np.empty((6, 4))
        tip_jacobian(CHAIN, q, p, J)
        e = problem.point - tip_position(CHAIN, q)
        np.testing.assert_allclose(H, J[:3].T @ J[:3], atol=1e-12)
        np.testing.assert_allclose(g, -J[:3].T @ e, atol=1e-12)
        assert cost == pytest.approx(e @ e, abs=1e-12)
        assert distance == pytest.approx(np.linalg.norm(e), abs=1e-12)


def test_pose_adds_the_rotation_error_about_the_joint_axes(within: Callable) -> None:
    rng = np.random.default_rng(2)
    for _ in range(50):
        problem, q = _problem(rng, POSE), within(rng, CHAIN.limits, False)
        turn = _random_turn(rng)
        problem = problem._replace(rotation=rotation_from_vector(turn) @ tip_rotation(q))
        cost, distance, H, g = _evaluate(problem, q)
        p, J = np.empty(3), np.empty((6, 4))
        tip_jacobian(CHAIN, q, p, J)
        e = np.concatenate([problem.point - tip_position(CHAIN, q), turn])
        np.testing.assert_allclose(H, J.T @ J, atol=1e-12)
        np.testing.assert_allclose(g, -J.T @ e, atol=1e-12)
        assert cost == pytest.approx(distance**2 + turn @ turn, abs=1e-12)


@pytest.mark.parametrize("kind", [POSITION, COUPLED])
def test_g_is_half_the_gradient_of_the_cost(kind: int, within: Callable) -> None:
    rng, h = np.random.default_rng(3), 1e-6
    for _ in range(50):
        problem, q = _problem(rng, kind, prior_weight=0.5), within(rng, CHAIN.limits, False)
        _, _, _, g = _evaluate(problem, q)
        steps = h * np.eye(4)
        slope = [
            (_evaluate(problem, q + s)[0] - _evaluate(problem, q - s)[0]) / 2e-6 for s in steps
        ]
        np.testing.assert_allclose(2.0 * g, slope, atol=1e-8)


def test_coupling_and_prior_are_equations_of_their_own(within: Callable) -> None:
    rng = np.random.default_rng(4)
    problem, q = _problem(rng, COUPLED, prior_weight=0.5), within(rng, CHAIN.limits, False)
    alone = problem._replace(kind=POSITION, prior=np.zeros((2, 4)))
    row = COUPLING_WEIGHT * CHAIN.coupling[1] * np.array([0.0, 0.0, CHAIN.coupling[0], -1.0])
    A = np.vstack([row, np.diag(problem.prior[1])])
    e = np.concatenate([[row @ q], problem.prior[1] * (q - problem.prior[0])])
    np.testing.assert_allclose(
        _evaluate(problem, q)[2], _evaluate(alone, q)[2] + A.T @ A, atol=1e-12
    )
    np.testing.assert_allclose(
        _evaluate(problem, q)[3], _evaluate(alone, q)[3] + A.T @ e, atol=1e-12
    )


def test_rotation_error_is_the_rotation_vector_in_the_frame_of_abduction(within: Callable) -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        q, turn = within(rng, CHAIN.limits, False), _random_turn(rng)
        goal, bend = rotation_from_vector(turn) @ tip_rotation(q), q[1:].sum()
        error = rotation_error(goal, np.sin(q[0]), np.cos(q[0]), np.sin(bend), np.cos(bend))
        np.testing.assert_allclose(error, rotation_y(q[0]).T @ turn, atol=1e-12)
