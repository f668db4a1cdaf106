"""Where joints can bend to, and which limits are reached."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import CHAIN_JOINTS, HANDS, HandName, default_hand, forward
from services.viewer.scene.limit_lines import REACHED_RAD, HandLimits


def middle_of(limits_rad: Array) -> Array:
    middle: Array = limits_rad.mean(axis=2)
    return middle


@pytest.mark.parametrize("hand", HANDS)
def test_a_bone_at_its_limit_lies_along_the_end_of_its_arc(hand: HandName) -> None:
    """Each angle of each digit, driven to each of its limits, however the hand is turned."""
    model, rng = default_hand(hand), np.random.default_rng(0)
    limits = HandLimits(model)
    for row in range(5):
        for column in range(4):
            for end in range(2):
                angles = middle_of(model.limits_rad)
                angles[row, column] = model.limits_rad[row, column, end]
                turn = rotation_from_vector(rng.normal(size=3))
                positions, rotations = forward(model, turn, rng.normal(size=3), angles)
                lines_m, reached = limits.lines(positions, rotations, angles)
                if np.ptp(model.limits_rad[row, column]) == 0.0:
                    assert not reached.any()
                    continue
                # The bone that this angle turns: both of a root turn the first.
                joint = CHAIN_JOINTS[row, max(column - 1, 0)]
                bone = positions[joint + 1] - positions[joint]
                bone /= np.linalg.norm(bone)
                from_joint = lines_m[reached].reshape(-1, 3) - positions[joint]
                far = from_joint[np.linalg.norm(from_joint, axis=1) > 1e-6]
                far /= np.linalg.norm(far, axis=1)[:, None]
                # The rim of a cone has the bone between two of its corners: 5 mrad of chord.
                assert (far @ bone).max() == pytest.approx(1.0, abs=0.04 if column < 2 else 1e-9)


def test_arcs_move_with_the_hand_and_are_as_large_as_its_bones() -> None:
    small, large = default_hand("right", 0.8), default_hand("right", 1.2)
    angles = middle_of(small.limits_rad)
    sizes = []
    for model in (small, large):
        lines_m, _ = HandLimits(model).lines(
            *forward(model, np.eye(3), np.zeros(3), angles), angles
        )
        moved, _ = HandLimits(model).lines(*forward(model, np.eye(3), np.ones(3), angles), angles)
        np.testing.assert_allclose(moved, lines_m + 1.0)
        sizes.append(np.linalg.norm(lines_m[:, 1] - lines_m[:, 0], axis=1))
    np.testing.assert_allclose(sizes[1], 1.5 * sizes[0], atol=1e-12)


@pytest.mark.parametrize(("off_deg", "lit"), [(0.0, True), (1.9, True), (-1.9, True), (2.1, False)])
def test_a_limit_is_reached_within_two_degrees(off_deg: float, lit: bool) -> None:
    model = default_hand("right")
    angles = middle_of(model.limits_rad)
    assert not HandLimits(model).reached(angles).any()
    angles[1, 2] = model.limits_rad[1, 2, 1] - np.deg2rad(off_deg)
    reached = HandLimits(model).reached(angles)
    assert np.rad2deg(REACHED_RAD) == pytest.approx(2.0)
    assert np.flatnonzero(reached).tolist() == ([2 * (4 + 2) + 1] if lit else [])


def test_angles_beyond_all_reason_are_drawn_somewhere_finite() -> None:
    model = default_hand("left")
    positions, rotations = forward(model, np.eye(3), np.zeros(3), np.zeros((5, 4)))
    lines_m, reached = HandLimits(model).lines(positions, rotations, np.full((5, 4), 1e300))
    assert np.isfinite(lines_m).all()
    assert not reached.any()
