"""FABRIK with limits: reach, traps, invariance, limits under fuzzing; the paper's beside it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand import chain_forward, default_hand
from services.solver.finger import fabrik, fabrik_paper
from services.solver.finger.bending_plane import bending_plane
from services.solver.finger.dls import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.finger.swing_limits import BOX, ELLIPSE, PARABOLA
from services.solver.maths.chains import canonical_from_wrist, digit_chain, hand_chains
from services.solver.maths.kinematics import tip_position

CHAINS = hand_chains(default_hand())
INDEX = digit_chain(CHAINS, 1)


@pytest.mark.parametrize("row", [0, 1, 2])
@pytest.mark.parametrize("coupled", [True, False])
def test_reachable_targets_from_anywhere(row: int, coupled: bool, within: Callable) -> None:
    chain, rng, solved = digit_chain(CHAINS, row), np.random.default_rng(row), 0
    for _ in range(400):
        point = tip_position(chain, within(rng, chain.limits, coupled))
        q = within(rng, chain.limits, False)
        _, left, state = fabrik.solve(chain, point, q, BOX, 1000, 1e-4)
        assert np.all(q >= chain.limits[:, 0])
        assert np.all(q <= chain.limits[:, 1])
        solved += left <= 1e-4 and state == SOLVED
    assert solved >= 398


def test_the_coupling_gives_the_angles_too(within: Callable) -> None:
    rng, errors = np.random.default_rng(3), []
    for _ in range(300):
        angles = within(rng, INDEX.limits, True)
        q = within(rng, INDEX.limits, False)
        fabrik.solve(INDEX, tip_position(INDEX, angles), q, BOX, 1000, 1e-5)
        errors.append(np.abs(q - angles).max())
    assert np.median(errors) < np.deg2rad(0.1)
    assert np.percentile(errors, 95) < np.deg2rad(2.0)


def test_turning_the_world_changes_nothing(within: Callable) -> None:
    rng = np.random.default_rng(4)
    for _ in range(5):
        target, start = within(rng, INDEX.limits, True), within(rng, INDEX.limits, False)
        in_wrist = CHAINS.base_m[1] + CHAINS.base_rotation[1] @ tip_position(INDEX, target)
        results = []
        for _ in range(100):
            turn, shift = rotation_from_quaternion(rng.normal(size=4)), rng.normal(size=3)
            q = start.copy()
            base = turn @ CHAINS.base_m[1] + shift
            axes = turn @ CHAINS.base_rotation[1]
            point = canonical_from_wrist(base, axes, 1.0, turn @ in_wrist + shift)
            fabrik.solve(INDEX, point, q, BOX, 1000, 1e-4)
            results.append(q)
        assert np.ptp(results, axis=0).max() < 1e-6


def test_a_target_on_the_line_of_a_straight_chain() -> None:
    """Plain FABRIK never bends it; a knuckle that extends by 60 deg can."""
    limits = INDEX.limits.copy()
    limits[1, 0] = -np.pi / 3
    chain, point = INDEX._replace(limits=limits), np.array([0.0, 0.0, -0.05])
    joints = fabrik_paper.joint_positions(
        np.zeros(4), np.array([*INDEX.lengths[:2], -INDEX.tool[2]]), 0.0
    )
    fabrik_paper.reach(joints, point, INDEX.lengths, 200, 1e-4)
    assert not joints[:, 1].any()
    q = np.zeros(4)
    _, left, state = fabrik.solve(chain, point, q, BOX, 1000, 1e-4)
    assert state == SOLVED
    assert left <= 1e-4


def test_a_limit_deadlock_is_left() -> None:
    """From a hook (knuckle straight, the rest curled) to a bent knuckle: FABRIK alone hangs."""
    angles = np.array([0.0, 1.5, 0.05, 0.0333])
    q = np.array([0.0, 0.0, 1.9, 1.5])
    _, left, state = fabrik.solve(INDEX, tip_position(INDEX, angles), q, BOX, 1000, 1e-4)
    assert state == SOLVED
    assert left <= 1e-4


def test_out_of_reach_it_points_there() -> None:
    q = np.array([0.1, 0.5, 0.5, 0.3])
    direction = np.array([-0.02, -0.1, -1.0]) / np.linalg.norm([0.02, 0.1, 1.0])
    _, left, state = fabrik.solve(INDEX, direction * 0.5, q, BOX, 1000, 1e-4)
    assert state == UNREACHABLE
    p = tip_position(INDEX, q)
    np.testing.assert_allclose(p / np.linalg.norm(p), direction, atol=1e-2)
    assert left == pytest.approx(0.5 - np.linalg.norm(p), abs=1e-3)


@pytest.mark.parametrize("shape", [ELLIPSE, PARABOLA])
def test_a_swing_limit_narrows_the_base(shape: int) -> None:
    corner = np.array([INDEX.limits[0, 1], INDEX.limits[1, 1], 0.3, 0.2])
    q = np.zeros(4)
    _, _, state = fabrik.solve(INDEX, tip_position(INDEX, corner), q, shape, 1000, 1e-4)
    assert state == UNREACHABLE
    assert q[0] < 0.8 * INDEX.limits[0, 1]


wild = st.floats(allow_nan=True, allow_infinity=True, width=64)
near = st.floats(-0.12, 0.12)


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.one_of(wild, near), min_size=3, max_size=3),
    st.lists(wild, min_size=4, max_size=4),
    st.lists(st.sampled_from([0.0, 1e-12, 0.02, 0.05, 0.2]), min_size=3, max_size=3),
    st.sampled_from(["fabrik", "paper"]),
)
def test_nothing_leaves_the_limits(
    point: list[float], start: list[float], bones: list[float], method: str
) -> None:
    # Alike in test_dls.py: every method makes the same promise.
    chain = INDEX._replace(lengths=np.array(bones), tool=np.array([0.0, 0.0, -bones[2]]))
    q, target = np.array(start), np.array(point)
    if method == "fabrik":
        used, left, state = fabrik.solve(chain, target, q, BOX, 60, 1e-4)
    else:
        used, left, state = fabrik_paper.solve(chain, target, q, 60, 1e-4)
    assert np.all(q >= chain.limits[:, 0])
    assert np.all(q <= chain.limits[:, 1])
    assert used <= 200
    assert state in (SOLVED, UNREACHABLE, NOT_CONVERGED)
    assert not np.isnan(left)


def test_the_papers_fabrik_reaches_in_space_but_not_with_a_hands_joints(within: Callable) -> None:
    rng = np.random.default_rng(6)
    bones, reached, anatomical = INDEX.lengths.copy(), 0, 0
    bones[2] = -INDEX.tool[2]
    for _ in range(300):
        point = tip_position(INDEX, within(rng, INDEX.limits, True))
        q = within(rng, INDEX.limits, False)
        joints = fabrik_paper.joint_positions(q, bones, 0.0)
        fabrik_paper.reach(joints, point, bones, 200, 1e-5)
        reached += np.linalg.norm(joints[3] - point) <= 1e-4
        np.testing.assert_allclose(
            np.linalg.norm(np.diff(joints, axis=0), axis=1), bones, atol=1e-12
        )
        anatomical += fabrik_paper.solve(INDEX, point, q, 200, 1e-4)[2] == SOLVED
    assert reached > 270
    assert anatomical < 150


@pytest.mark.parametrize("palm_side_m", [0.0, -0.004])
def test_the_papers_chain_of_points_agrees_with_the_hand_model(
    within: Callable, tip_pose: Callable, palm_side_m: float
) -> None:
    """With the painted point on the bone's axis, and on the palm side of it."""
    chain = INDEX._replace(tool=np.array([0.0, palm_side_m, INDEX.tool[2]]))
    plane, rng = bending_plane(chain), np.random.default_rng(7)
    for _ in range(50):
        q, back = within(rng, chain.limits, False), np.zeros(4)
        joints = fabrik_paper.joint_positions(q, plane.bones, plane.gamma)
        expected, _ = chain_forward(np.eye(3), np.zeros(3), chain.lengths, q)
        np.testing.assert_allclose(joints[:3], expected[:3], atol=1e-12)
        np.testing.assert_allclose(joints[3], tip_pose(chain, q)[0], atol=1e-12)
        if np.hypot(joints[3, 0], joints[3, 2]) > 1e-3 and joints[3, 2] < 0.0:
            fabrik_paper.angles_from_positions(joints, plane.gamma, chain.limits, back)
            np.testing.assert_allclose(back, q, atol=1e-9)
