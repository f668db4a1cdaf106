"""The numbers of a pose: rounded, within limits, and how sure they are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rhot.hand import default_hand, forward
from services.solver.finger.outcome import NOT_SEEN, SOLVED
from services.solver.finger.solve_fingers import FingerSolution
from services.solver.maths.chains import hand_chains
from services.solver.pose_numbers import (
    DIGIT_ROWS,
    JOINT_ROWS,
    WRIST_ROW,
    pose_numbers,
    rounded,
    rounded_within_limits,
    standard_deviations,
)


def test_rounding_has_no_negative_zero() -> None:
    assert str([rounded(value) for value in (-1e-9, 0.1234567)]) == "[0.0, 0.123457]"


def test_rounding_does_not_leave_the_limits() -> None:
    limits = np.tile(np.array([-1.0 / 3.0, 1.0 / 3.0]), (5, 4, 1))
    inside = rounded_within_limits(np.full((5, 4), 1.0 / 3.0), limits)
    assert np.all(inside <= limits[..., 1])
    assert rounded_within_limits(np.full((5, 4), 0.1234567), limits)[0, 0] == pytest.approx(
        0.123457
    )


def test_rows_are_joints_digits_and_the_wrist() -> None:
    model = default_hand("left")
    angles = model.limits_rad.mean(axis=2)
    ends = np.array([[3.0, 0.0012345678, 0.0]] * 5)
    status = np.array([SOLVED, SOLVED, SOLVED, SOLVED, NOT_SEEN])
    wrist = np.eye(3), np.array([0.1, 0.2, 0.5])
    variances = np.full(26, 1e-4)
    numbers = pose_numbers(
        hand_chains(model), wrist, FingerSolution(angles, ends, status), variances, 1.25
    )
    positions, _ = forward(model, *wrist, angles)
    np.testing.assert_allclose(numbers[JOINT_ROWS, :3], positions, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(numbers[JOINT_ROWS, 3:7], axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(numbers[DIGIT_ROWS, :4], angles, atol=1e-6)
    assert numbers[DIGIT_ROWS, 4:7].tolist() == [[0.001235, 3.0, s] for s in status]
    np.testing.assert_allclose(numbers[DIGIT_ROWS, 7], 0.01)
    np.testing.assert_allclose(numbers[WRIST_ROW, :3], [0.017321, 0.017321, 1.25])


def test_nothing_known_is_half_a_turn_and_a_metre() -> None:
    model = default_hand("right")
    fingers = FingerSolution(np.zeros((5, 4)), np.zeros((5, 3)), np.full(5, NOT_SEEN))
    wrist = np.eye(3), np.zeros(3)
    numbers = pose_numbers(hand_chains(model), wrist, fingers, np.full(26, 1e6), -1.0)
    assert numbers[WRIST_ROW, :2].tolist() == [1.0, round(math.pi, 6)]
    assert numbers[DIGIT_ROWS, 7].tolist() == [round(math.pi, 6)] * 5


def test_angles_that_cannot_move_say_nothing_of_a_digits_sigma() -> None:
    limits = np.tile(np.array([-1.0, 1.0]), (5, 4, 1))
    limits[2, 0] = 0.0
    variances = np.full(26, 4e-4)
    variances[6 + 4 * 2] = 1.0
    np.testing.assert_allclose(standard_deviations(variances, limits)[2:], 0.02)
