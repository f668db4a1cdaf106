"""Damped least squares: the figures promised, all kinds of goals, limits, no solution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand import default_hand
from services.solver.finger import dls
from services.solver.finger.dls_equations import COUPLED, POSE, POSITION, Goal, tip_goal
from services.solver.finger.outcome import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.maths.chains import canonical_from_wrist, digit_chain, hand_chains
from services.solver.maths.kinematics import tip_position

CHAINS = hand_chains(default_hand())
INDEX = digit_chain(CHAINS, 1)
FIRST = (0.0, np.pi / 2, 0.0, 0.0)


@pytest.mark.parametrize("straight", [False, True])
def test_grasps_of_37_frames_from_the_studys_start(
    grasp: Callable, tip_pose: Callable, straight: bool
) -> None:
    """Tip pose as the goal: 10 iterations at first, then 5, 1e-6 mm, never the mirror elbow."""
    rng = np.random.default_rng(5)
    for _ in range(200):
        chain = INDEX._replace(lengths=INDEX.lengths * rng.uniform(0.8, 1.2))
        q = np.array(FIRST)
        for frame, angles in enumerate(grasp(rng, straight=straight)):
            point, axes = tip_pose(chain, angles)
            used, left, state = dls.solve(chain, tip_goal(POSE, point, axes), q, 60, 1e-7)
            assert state == SOLVED
            assert used <= (10 if frame == 0 else 5)
            assert left <= 1e-9
            np.testing.assert_allclose(q, angles, atol=1e-3)


def test_grasps_from_position_and_coupling(grasp: Callable) -> None:
    rng = np.random.default_rng(6)
    for round_ in range(100):
        q = np.array(FIRST)
        for frame, angles in enumerate(grasp(rng, True, straight=round_ % 2 == 0)):
            used, left, _ = dls.solve(
                INDEX, tip_goal(COUPLED, tip_position(INDEX, angles)), q, 60, 1e-7
            )
            # A straight finger is singular: its first bend takes one more.
            assert used <= (10 if frame == 0 else 6)
            assert left <= 1e-9
            np.testing.assert_allclose(q, angles, atol=2e-3)


@pytest.mark.parametrize("row", [0, 1, 2, 4])
@pytest.mark.parametrize("kind", [POSITION, COUPLED])
def test_reachable_targets_from_anywhere(row: int, kind: int, within: Callable) -> None:
    chain, rng, solved = digit_chain(CHAINS, row), np.random.default_rng(row), 0
    for _ in range(500):
        point = tip_position(chain, within(rng, chain.limits, kind == COUPLED))
        q = within(rng, chain.limits, False)
        _, left, state = dls.solve(chain, tip_goal(kind, point), q, 60, 1e-7)
        assert np.all(q >= chain.limits[:, 0])
        assert np.all(q <= chain.limits[:, 1])
        solved += left <= 1e-4 and state == SOLVED
    assert solved >= 499


def test_a_finger_that_does_not_follow_the_ratio_is_still_reached() -> None:
    angles = np.array([0.05, 0.6, 0.9, 0.1])
    q = np.array([0.0, 0.3, 0.3, 0.2])
    _, left, state = dls.solve(INDEX, tip_goal(COUPLED, tip_position(INDEX, angles)), q, 60, 1e-7)
    assert state == SOLVED
    # The coupling is a soft constraint: it may cost a hundredth of a millimetre.
    assert left < 1e-5


def test_without_its_weight_the_coupling_does_nothing() -> None:
    free = INDEX._replace(coupling=np.array([2.0 / 3.0, 0.0]))
    angles = np.array([0.05, 0.6, 0.9, 0.1])
    q = angles.copy()
    used, _, _ = dls.solve(free, tip_goal(COUPLED, tip_position(INDEX, angles)), q, 60, 1e-7)
    assert used == 0
    np.testing.assert_array_equal(q, angles)


def test_out_of_reach_is_the_nearest_posture(within: Callable) -> None:
    """Against scipy's bounded least squares from many starts."""
    rng = np.random.default_rng(8)
    limits = INDEX.limits
    for _ in range(20):
        point = rng.normal(size=3)
        point *= 0.15 / np.linalg.norm(point)
        q = within(rng, limits, False)
        _, left, state = dls.solve(INDEX, tip_goal(POSITION, point), q, 60, 1e-7)
        assert state == UNREACHABLE
        best = min(
            least_squares(
                lambda a, p=point: tip_position(INDEX, a) - p,
                within(rng, limits, False),
                bounds=limits.T,
            ).cost
            for _ in range(4)
        )
        # A start of ours may end in another valley than the best of four; most must not.
        assert left <= np.sqrt(2.0 * best) + 0.03
        assert left == pytest.approx(np.linalg.norm(tip_position(INDEX, q) - point))


def test_beyond_reach_it_points_there() -> None:
    q = np.array([0.0, 0.5, 0.5, 0.3])
    dls.solve(INDEX, tip_goal(COUPLED, np.array([-0.02, -0.1, -1.0])), q, 60, 1e-7)
    direction = tip_position(INDEX, q)
    np.testing.assert_allclose(
        direction / np.linalg.norm(direction),
        np.array([-0.02, -0.1, -1.0]) / np.linalg.norm([0.02, 0.1, 1.0]),
        atol=0.02,
    )


def test_turning_the_world_changes_nothing(within: Callable) -> None:
    rng = np.random.default_rng(10)
    target = within(rng, INDEX.limits, True)
    in_wrist = CHAINS.base_m[1] + CHAINS.base_rotation[1] @ tip_position(INDEX, target)
    results = []
    for _ in range(100):
        turn, shift = rotation_from_quaternion(rng.normal(size=4)), rng.normal(size=3)
        base = turn @ CHAINS.base_m[1] + shift
        axes = turn @ CHAINS.base_rotation[1]
        point = canonical_from_wrist(base, axes, 1.0, turn @ in_wrist + shift)
        q = np.array(FIRST)
        dls.solve(INDEX, tip_goal(COUPLED, point), q, 60, 1e-7)
        results.append(q)
    assert np.ptp(results, axis=0).max() < 1e-6


wild = st.floats(allow_nan=True, allow_infinity=True, width=64)


@settings(max_examples=300, deadline=None)
@given(
    st.lists(wild, min_size=3, max_size=3),
    st.lists(wild, min_size=4, max_size=4),
    st.lists(st.sampled_from([0.0, 1e-12, 0.02, 0.05, 0.2]), min_size=3, max_size=3),
    st.sampled_from([POSITION, POSE, COUPLED]),
)
def test_nothing_leaves_the_limits(
    point: list[float], start: list[float], bones: list[float], kind: int
) -> None:
    # Alike in test_fabrik.py: every method makes the same promise.
    chain = INDEX._replace(lengths=np.array(bones), tool=np.array([0.0, 0.0, -bones[2]]))
    q = np.array(start)
    used, left, state = dls.solve(chain, tip_goal(kind, np.array(point)), q, 60, 1e-7)
    assert np.all(q >= chain.limits[:, 0])
    assert np.all(q <= chain.limits[:, 1])
    assert used <= 60
    assert state in (SOLVED, UNREACHABLE, NOT_CONVERGED)
    assert not np.isnan(left)


def test_a_start_that_its_prior_holds_is_not_repeated(within: Callable) -> None:
    rng = np.random.default_rng(9)
    for _ in range(200):
        start = within(rng, INDEX.limits, False)
        point = tip_position(INDEX, start) + rng.normal(0.0, 2e-3, 3)
        goal = Goal(POSITION, point, np.eye(3), np.vstack([start, np.full(4, 0.5)]))
        q = start.copy()
        used, left, state = dls.solve(INDEX, goal, q, 200, 1e-9)
        assert used <= 20
        assert left > 1e-9
        assert state == UNREACHABLE
        # There was nothing to be found elsewhere.
        other = within(rng, INDEX.limits, False)
        dls.solve(INDEX, goal, other, 200, 1e-9)
        np.testing.assert_allclose(other, q, atol=1e-4)


def test_all_digits_at_once_are_each_alone(within: Callable) -> None:
    rng = np.random.default_rng(11)
    angles = np.array([within(rng, CHAINS.limits_rad[row], True) for row in range(5)])
    tips = [tip_position(digit_chain(CHAINS, row), angles[row]) for row in range(5)]
    points = CHAINS.base_m + np.einsum("rij,rj->ri", CHAINS.base_rotation, tips)
    together, ends = np.full((5, 4), 0.2), np.zeros((5, 3))
    start = np.clip(together, CHAINS.limits_rad[..., 0], CHAINS.limits_rad[..., 1])
    targets = dls.TipTargets(points, np.array([1, 1, 0, 1, 1]), np.zeros(5))
    dls.solve_digits(CHAINS, targets, together, 60, 1e-4, ends)
    for row in (0, 1, 3, 4):
        chain, q = digit_chain(CHAINS, row), start[row].copy()
        base, axes = CHAINS.base_m[row], CHAINS.base_rotation[row]
        point = canonical_from_wrist(base, axes, 1.0, points[row])
        used, left, state = dls.solve(chain, tip_goal(COUPLED, point), q, 60, 1e-7)
        np.testing.assert_allclose(together[row], q, atol=1e-5)
        assert (ends[row, 1], ends[row, 2]) == (pytest.approx(left, abs=1e-7), state)
        assert abs(ends[row, 0] - used) <= 1
    np.testing.assert_array_equal(together[2], np.full(4, 0.2))
