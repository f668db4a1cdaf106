"""A shape is moved onto points as one piece, wherever they are sure."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from services.fusion.one_camera.rigid_fit import jacobian, rotation, start_fit, step_fit

SHAPE = np.random.default_rng(3).normal(0.0, 0.05, (6, 3)) + np.array([0.1, -0.2, 0.6])


def fitted(shape, points, weights, steps=6):
    fit = start_fit(shape)
    arms = shape - fit.centre
    squares = [step_fit(fit, arms, points, weights) for _ in range(steps)]
    return fit, fit.centre + arms @ fit.R.T, squares


def moved(vector, shift):
    about = SHAPE.mean(axis=0)
    return about + (SHAPE - about) @ Rotation.from_rotvec(vector).as_matrix().T + shift


def test_rotations_are_scipys():
    for vector in ([0.0, 0.0, 0.0], [0.3, -0.2, 0.5], [1e-7, 0.0, 0.0]):
        expected = Rotation.from_rotvec(vector).as_matrix()
        np.testing.assert_allclose(rotation(np.array(vector)), expected, atol=1e-12)


def test_a_jacobian_is_the_change_of_a_turned_and_shifted_arm():
    arm, step = np.array([0.03, -0.05, 0.02]), np.array([1.0, 2.0, -1.0, 0.4, -0.3, 0.2]) * 1e-6
    J = np.empty((3, 6))
    jacobian(arm, J)
    np.testing.assert_allclose(J @ step, step[:3] + rotation(step[3:]) @ arm - arm, atol=1e-12)


def test_a_shape_is_brought_to_where_it_went():
    points = moved([0.2, -0.3, 0.1], [0.02, -0.01, 0.03])
    _, found, squares = fitted(SHAPE, points, np.tile(np.eye(3) * 1e6, (6, 1, 1)))
    np.testing.assert_allclose(found, points, atol=2e-5)
    assert squares[-1] < 1.0 < squares[0]


def test_size_in_one_picture_gives_depth():
    """Points that are centimetres off along the rays of one camera, and exact across."""
    truth = moved([0.05, 0.1, -0.05], [0.01, 0.02, 0.03])
    weights = np.empty((6, 3, 3))
    for n, ray in enumerate(truth / np.linalg.norm(truth, axis=1, keepdims=True)):
        along = np.outer(ray, ray)
        weights[n] = along / 0.05**2 + (np.eye(3) - along) / 1e-4**2
    points = truth * 1.06  # 40 mm too far, all of them
    fit, found, _ = fitted(SHAPE, points, weights, 10)
    assert np.linalg.norm(points - truth, axis=1).min() > 0.02
    assert np.linalg.norm(found - truth, axis=1).max() < 0.003
    assert np.sqrt(np.linalg.inv(fit.information)[2, 2]) < 0.005


def test_points_in_a_row_do_not_send_the_fit_away():
    row = np.array([[0.0, 0.0, 0.5], [0.05, 0.0, 0.5], [0.1, 0.0, 0.5]])
    shifted = row + np.array([0.01, 0.0, 0.0])
    _, found, _ = fitted(row, shifted, np.tile(np.eye(3) * 1e6, (3, 1, 1)))
    np.testing.assert_allclose(found, shifted, atol=1e-5)
    assert found == pytest.approx(row, abs=0.02)
