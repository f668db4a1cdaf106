"""The relative pose of two cameras, with bad pairs, and with nothing to go by."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import angle_between, inverse
from services.calibrator.board.corner_order import rotated_numberings
from services.calibrator.bundle.initial_guess import ideal_lens
from services.calibrator.bundle.lens_model import lens_vector
from services.calibrator.bundle.residuals import View
from services.calibrator.rig.relative_pose import guess_relative_pose, nearest_numbering


def view_of(bench, camera: int, key: str) -> View:
    corners = bench.corners(bench.cameras[camera], key)
    return View(camera, 0, np.arange(bench.board.size), bench.board.points, corners)


def test_two_cameras_are_related_in_spite_of_a_bad_pair(make_bench):
    """Test: one pair of views in six is of different boards.

    Expected: the relative pose of the other five.
    """
    bench = make_bench(2, 6)
    first, second = bench.cameras
    pairs = [(view_of(bench, 0, key), view_of(bench, 1, key)) for key in bench.poses]
    pairs[2] = (pairs[2][0], pairs[4][1])
    lenses = (
        lens_vector(first.matrix, first.distortion),
        lens_vector(second.matrix, second.distortion),
    )
    found = guess_relative_pose(lenses, pairs, [np.arange(54)])
    assert found.median_px < 0.1
    assert found.errors_px[2] > 10.0
    assert angle_between(found.T_second_from_first[:3, :3], second.T_camera_from_rig[:3, :3]) < 1e-3


def test_nothing_to_relate_fits_nothing():
    lens = ideal_lens((640, 480), 500.0)
    assert guess_relative_pose((lens, lens), [], [np.arange(4)]).median_px == float("inf")


@pytest.mark.parametrize("turned", [0, 1])
def test_the_numbering_nearest_to_the_expected_pose_is_chosen(make_bench, turned):
    bench = make_bench(1, 1)
    camera = bench.cameras[0]
    lens = lens_vector(camera.matrix, camera.distortion)
    numberings = rotated_numberings(9, 6)
    view = view_of(bench, 0, "01")
    view = View(0, 0, view.ids, view.points, view.pixels[numberings[turned]])
    expected = inverse(camera.T_rig_from_camera) @ bench.poses["01"]
    assert nearest_numbering(lens, view, expected, numberings) == turned
    assert nearest_numbering(lens, view, expected, numberings[:1]) == 0
