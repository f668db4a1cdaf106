"""First guesses: good enough for the adjustment, and finite where there is nothing to guess."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.board.board_views import board_view
from services.calibrator.bundle.initial_guess import guess_board_pose, guess_lens
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import View


@pytest.mark.parametrize("focal_px", [300.0, 527.0, 1500.0])
def test_the_focal_length_is_guessed_within_a_fifth(make_bench, focal_px):
    depth = focal_px / 527.0
    bench = make_bench(
        1,
        6,
        focal_px=focal_px,
        distortion=(0.0,) * 5,
        depth_m=(0.35 * depth, 0.7 * depth),
        spread=0.2 / depth,
    )
    views = [
        board_view(bench.board, found, 0, k)
        for k, found in enumerate(bench.detections()["left"].values())
    ]
    assert guess_lens((640, 480), views)[0] == pytest.approx(focal_px, rel=0.25)


def test_a_boards_pose_is_exact_for_exact_corners(make_bench):
    bench = make_bench(1, 3)
    camera = bench.cameras[0]
    for key, true in bench.poses.items():
        view = View(0, 0, np.arange(54), bench.board.points, bench.corners(camera, key))
        T, error_px = guess_board_pose(lens_vector(camera.matrix, camera.distortion), view)
        np.testing.assert_allclose(T, true, atol=1e-4)
        assert error_px < 0.01


def test_pixels_that_no_ray_reaches_give_a_pose_in_front_of_the_camera_and_no_trust():
    folded = np.array([280.0, 280.0, 319.5, 239.5, -0.3, 0.1, 0.0, 0.0, -0.015])
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]])
    T, error_px = guess_board_pose(
        folded,
        View(
            0, 0, np.arange(4), points, np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0], [9.0, 9.0]])
        ),
    )
    assert error_px == float("inf")
    assert T[2, 3] > 0.0
