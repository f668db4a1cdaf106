"""First guesses: good enough for the adjustment, and finite where there is nothing to guess."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import angle_between
from services.calibrator.bundle.initial_guess import board_pose, centred, lens_guess, relate
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import View
from services.calibrator.bundle.views import view_of


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
        view_of(bench.board, found, 0, k)
        for k, found in enumerate(bench.detections()["left"].values())
    ]
    assert lens_guess((640, 480), views)[0] == pytest.approx(focal_px, rel=0.25)


def test_a_boards_pose_is_exact_for_exact_corners(make_bench):
    bench = make_bench(1, 3)
    camera = bench.cameras[0]
    for key, true in bench.poses.items():
        view = View(0, 0, np.arange(54), bench.board.points, bench.corners(camera, key))
        T, error_px = board_pose(lens_vector(camera.matrix, camera.distortion), view)
        np.testing.assert_allclose(T, true, atol=1e-4)
        assert error_px < 0.01


def test_pixels_that_no_ray_reaches_give_a_pose_in_front_of_the_camera_and_no_trust():
    folded = np.array([280.0, 280.0, 319.5, 239.5, -0.3, 0.1, 0.0, 0.0, -0.015])
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]])
    T, error_px = board_pose(
        folded,
        View(
            0, 0, np.arange(4), points, np.array([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0], [9.0, 9.0]])
        ),
    )
    assert error_px == float("inf")
    assert T[2, 3] > 0.0


def test_two_cameras_are_related_in_spite_of_a_bad_pair(make_bench):
    """Test: one pair of views in six is of different boards.

    Expected: the relation of the other five.
    """
    bench = make_bench(2, 6)
    a, b = bench.cameras
    pairs = [
        tuple(
            View(c, k, np.arange(54), bench.board.points, bench.corners(camera, key))
            for c, camera in enumerate((a, b))
        )
        for k, key in enumerate(bench.poses)
    ]
    pairs[2] = (pairs[2][0], pairs[4][1])
    found = relate(
        tuple(lens_vector(c.matrix, c.distortion) for c in (a, b)), pairs, [np.arange(54)]
    )
    assert found.median_px < 0.1
    assert found.errors_px[2] > 10.0
    assert angle_between(found.T_second_from_first[:3, :3], b.T_camera_from_rig[:3, :3]) < 1e-3


def test_nothing_to_relate_fits_nothing():
    lens = centred((640, 480), 500.0)
    assert relate((lens, lens), [], [np.arange(4)]).median_px == float("inf")
