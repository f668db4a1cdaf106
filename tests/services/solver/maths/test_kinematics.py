"""Compiled kinematics: against rhot.hand, finite differences, the finger study's Jacobian."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import (
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_x,
    rotation_z,
    transform,
)
from rhot.hand import (
    CHAIN_JOINTS,
    DIGITS,
    HANDS,
    HandName,
    chain_forward,
    default_hand,
    forward,
    landmark_point,
)
from services.solver.maths.chains import Chain, canonical_from_wrist, digit_chain, hand_chains
from services.solver.maths.kinematics import (
    digit_frames,
    hand_frames,
    tip_jacobian,
    tip_position,
    tip_rotation,
)


def _random(seed: int) -> tuple[Chain, np.ndarray]:
    rng = np.random.default_rng(seed)
    limits = np.array([[-0.3, 0.3], [-0.4, 1.6], [0.0, 1.9], [-0.5, 1.6]])
    chain = Chain(
        rng.uniform(0.02, 0.05, 3),
        np.array([*rng.normal(0.0, 0.003, 2), -0.013]),
        limits,
        np.array([2 / 3, 1.0]),
    )
    return chain, rng.uniform(limits[:, 0], limits[:, 1])


def _geometric_jacobian(chain: Chain, q: np.ndarray) -> np.ndarray:
    """From axes and lever arms (axis x arm), by the plain kinematics of rhot.hand; (6, 4)."""
    roots, frames = chain_forward(np.eye(3), np.zeros(3), chain.lengths, q)
    point = roots[2] + frames[2] @ chain.tool
    # Abduction turns about y, the flexions about -x of their joints; two share the root.
    axes = np.array([[0.0, 1.0, 0.0], *(-frames[:3, :, 0])])
    arms = point - roots[[0, 0, 1, 2]]
    return np.vstack([np.cross(axes, arms).T, axes.T])


@pytest.mark.parametrize("seed", range(20))
def test_one_digit_agrees_with_the_hand_model(seed: int, tip_pose: Callable) -> None:
    chain, q = _random(seed)
    point, axes = tip_pose(chain, q)
    p, J = np.empty(3), np.empty((6, 4))
    tip_jacobian(chain, q, p, J)
    np.testing.assert_allclose(tip_position(chain, q), point, atol=1e-15)
    np.testing.assert_allclose(p, point, atol=1e-15)
    np.testing.assert_allclose(tip_rotation(q), axes, atol=1e-15)
    np.testing.assert_allclose(J, _geometric_jacobian(chain, q), atol=1e-15)


@pytest.mark.parametrize("seed", range(20))
def test_jacobian_is_the_derivative(seed: int) -> None:
    chain, q = _random(seed)
    p, J = np.empty(3), np.empty((6, 4))
    tip_jacobian(chain, q, p, J)
    for j in range(4):
        h = np.zeros(4)
        h[j] = 1e-6
        linear = (tip_position(chain, q + h) - tip_position(chain, q - h)) / 2e-6
        np.testing.assert_allclose(J[:3, j], linear, atol=1e-9)
        # R' R^T is the cross product matrix of the axis.
        spin = (tip_rotation(q + h) - tip_rotation(q - h)) / 2e-6 @ tip_rotation(q).T
        np.testing.assert_allclose(J[3:, j], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-9)


def _study_a1(theta: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Matrix A1 of the finger study's appendix, as printed."""
    l1, l2, l3 = length
    s1, c1, s2, c2 = np.sin(theta[0]), np.cos(theta[0]), np.sin(theta[1]), np.cos(theta[1])
    s23, c23 = np.sin(theta[1] + theta[2]), np.cos(theta[1] + theta[2])
    s234, c234 = np.sin(theta[1:].sum()), np.cos(theta[1:].sum())
    r, z = l1 * c2 + l2 * c23 + l3 * c234, l1 * s2 + l2 * s23 + l3 * s234
    r3, z3 = l2 * c23 + l3 * c234, l2 * s23 + l3 * s234
    return np.array(
        [
            [-s1 * r, -c1 * z, -c1 * z3, -l3 * c1 * s234],
            [c1 * r, -s1 * z, -s1 * z3, -l3 * s1 * s234],
            [0.0, r, r3, l3 * c234],
            [0.0, s1, s1, s1],
            [0.0, -c1, -c1, -c1],
            [1.0, 0.0, 0.0, 0.0],
        ]
    )


def _dh(theta: float, a: float, alpha: float) -> np.ndarray:
    """One standard Denavit-Hartenberg row, R_z(theta) T_x(a) R_x(alpha)."""
    turn = transform(rotation_z(theta), np.zeros(3))
    return turn @ transform(rotation_x(alpha), (a, 0.0, 0.0))


@pytest.mark.parametrize("seed", range(10))
def test_the_studys_jacobian_is_ours_with_its_axes_renamed(seed: int) -> None:
    chain, q = _random(seed)
    chain = chain._replace(tool=np.array([0.0, 0.0, -chain.lengths[2]]))
    # x_DH = -z, y_DH = x, z_DH = -y turns our axes into the study's; its abduction turns the other
    # way.
    rename = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    assert np.linalg.det(rename) == pytest.approx(1.0)
    theta = q * [-1.0, 1.0, 1.0, 1.0]
    rows = zip(theta, (0.0, *chain.lengths), (np.pi / 2, 0.0, 0.0, 0.0), strict=True)
    T = np.eye(4)
    for angle, a, alpha in rows:
        T = T @ _dh(angle, a, alpha)
    np.testing.assert_allclose(rename @ tip_position(chain, q), T[:3, 3], atol=1e-15)
    p, J = np.empty(3), np.empty((6, 4))
    tip_jacobian(chain, q, p, J)
    ours = np.vstack([rename @ J[:3], rename @ J[3:]]) * [-1.0, 1.0, 1.0, 1.0]
    np.testing.assert_allclose(ours, _study_a1(theta, chain.lengths), atol=1e-15)


@pytest.mark.parametrize("hand", HANDS)
def test_hand_frames_equal_the_hand_model(hand: HandName) -> None:
    model = default_hand(hand)
    chains = hand_chains(model)
    rng = np.random.default_rng(3)
    for _ in range(20):
        R, t = rotation_from_quaternion(rng.normal(size=4)), rng.normal(size=3)
        angles = rng.uniform(model.limits_rad[..., 0], model.limits_rad[..., 1])
        positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
        hand_frames(chains, R, t, angles, positions, rotations)
        expected = forward(model, R, t, angles)
        np.testing.assert_allclose(positions, expected[0], atol=1e-14)
        np.testing.assert_allclose(rotations, expected[1], atol=1e-14)


@pytest.mark.parametrize("hand", HANDS)
def test_digit_frames_agree_with_the_hand_model(hand: HandName) -> None:
    model, rng = default_hand(hand), np.random.default_rng(5)
    chains = hand_chains(model)
    for _ in range(20):
        angles = rng.uniform(model.limits_rad[..., 0], model.limits_rad[..., 1])
        frames = digit_frames(chains, angles)
        positions, rotations = forward(model, np.eye(3), np.zeros(3), angles)
        np.testing.assert_allclose(frames.roots_m, positions[CHAIN_JOINTS], atol=1e-12)
        np.testing.assert_allclose(frames.rotations, rotations[CHAIN_JOINTS], atol=1e-12)


@pytest.mark.parametrize("hand", HANDS)
def test_digit_frames_have_the_axes_of_the_angles(hand: HandName) -> None:
    """Turning a digit about an axis is what its angle does, by finite differences."""
    model, h = default_hand(hand), 1e-6
    angles = np.random.default_rng(6).uniform(model.limits_rad[..., 0], model.limits_rad[..., 1])
    axes = digit_frames(hand_chains(model), angles).axes
    _, before = forward(model, np.eye(3), np.zeros(3), angles)
    for row, tip in enumerate(CHAIN_JOINTS[:, 3]):
        for a in range(4):
            moved = angles.copy()
            moved[row, a] += h
            _, after = forward(model, np.eye(3), np.zeros(3), moved)
            turned = rotation_from_vector(h * axes[row, a]) @ before[tip]
            np.testing.assert_allclose(after[tip], turned, atol=1e-11)


@pytest.mark.parametrize("hand", HANDS)
def test_a_chain_ends_in_the_painted_tip(hand: HandName) -> None:
    model = default_hand(hand)
    chains = hand_chains(model)
    angles = np.random.default_rng(4).uniform(model.limits_rad[..., 0], model.limits_rad[..., 1])
    joints = forward(model, np.eye(3), np.zeros(3), angles)
    for row, name in enumerate(DIGITS):
        point = landmark_point(model, f"{name}_tip", *joints)
        canonical = canonical_from_wrist(
            chains.base_m[row], chains.base_rotation[row], chains.side, point
        )
        np.testing.assert_allclose(
            tip_position(digit_chain(chains, row), angles[row]), canonical, atol=1e-14
        )


def test_left_and_right_are_mirror_images() -> None:
    left, right = default_hand("left"), default_hand("right")
    angles = right.limits_rad.mean(axis=2) + 0.1
    mirror = np.diag([-1.0, 1.0, 1.0])
    there, _ = forward(right, np.eye(3), np.zeros(3), angles)
    here, _ = forward(left, np.eye(3), np.zeros(3), angles)
    np.testing.assert_allclose(here, there @ mirror, atol=1e-15)
