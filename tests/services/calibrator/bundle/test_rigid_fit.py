"""Triangulation and the rigid fit against exact geometry."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import apply, rotation_from_vector, transform
from rhot.geometry.triangulation import triangulate
from services.calibrator.board.board import Board
from services.calibrator.bundle.lens_model import lens_vector, rays_from_pixels
from services.calibrator.bundle.rigid_fit import epipolar_px, rigid_fit


@pytest.mark.parametrize("cameras", [2, 4])
def test_exact_pixels_give_exact_points_on_exact_epipolar_lines(make_bench, cameras):
    bench = make_bench(cameras, positions=1)
    true = apply(bench.poses["01"], bench.board.points)
    seen = np.stack(
        [
            rays_from_pixels(lens_vector(c.matrix, c.distortion), c.project(true))
            for c in bench.cameras
        ]
    )
    places = np.stack([camera.T_camera_from_rig for camera in bench.cameras])
    np.testing.assert_allclose(triangulate(places, seen, np.full(cameras, 527.0)), true, atol=1e-9)
    np.testing.assert_allclose(epipolar_px(places[1], seen[0], seen[1], 527.0), 0.0, atol=1e-7)


def test_epipolar_distance_is_in_pixels():
    """Two parallel cameras: the second sees every point 2 px lower."""
    T = transform(np.eye(3), [-0.075, 0.0, 0.0])
    first = np.array([[0.1, 0.0], [0.0, -0.1]])
    np.testing.assert_allclose(
        np.abs(epipolar_px(T, first, first + np.array([-0.05, 2.0 / 500.0]), 500.0)), 2.0, rtol=1e-9
    )


def test_the_rigid_fit_finds_rotation_translation_and_scale():
    board = Board(5, 4, 0.03).points
    R, t = rotation_from_vector([0.3, -0.5, 2.0]), np.array([0.1, 0.2, 0.6])
    fit = rigid_fit(board, 1.01 * board @ R.T + t)
    np.testing.assert_allclose(fit.R_measured_from_board, R, atol=1e-12)
    assert fit.scale == pytest.approx(1.01)
    exact = rigid_fit(board, board @ R.T + t)
    np.testing.assert_allclose(exact.errors, 0.0, atol=1e-12)
    np.testing.assert_allclose(exact.t, t, atol=1e-12)


def test_the_scale_of_noisy_points_has_no_bias():
    """Test: noise of a tenth of a square in depth.

    Expected: the scale is right to .1 %, where the mean side would be 1 % too long.
    """
    board, generator = Board(9, 6, 0.025).points, np.random.default_rng(0)
    scales = [
        rigid_fit(board, board + generator.normal(0.0, [0.0, 0.0, 0.0025], board.shape)).scale
        for _ in range(50)
    ]
    assert np.mean(scales) == pytest.approx(1.0, abs=1e-3)
