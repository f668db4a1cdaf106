"""Where the centroid of a painted finger tip is seen and located, against ray-casting."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.projection import extrinsics
from services.fusion.output.paint_centroid import centroid_shift, located_shift, shift_table
from testing.synthetic_points import SyntheticRig

RADIUS_M, PAINT_M = 0.0068, 0.014


def test_shift_is_along_the_finger_and_vanishes_end_on():
    table = shift_table(RADIUS_M, PAINT_M)
    assert centroid_shift(table, -1.0) == pytest.approx(0.0, abs=1e-5)
    # Seen from the side, the round end has less paint than the straight stretch behind it.
    assert -1e-3 < centroid_shift(table, 0.0) < -0.3e-3
    assert -2e-3 < centroid_shift(table, -0.6) < -1e-3
    assert not shift_table(0.0, 0.01).any()


def test_known_direction_explains_where_the_centroid_is_located(random_fingers, split):
    cameras = tuple(SyntheticRig(distortion=(0.0,) * 5).rig().values())
    table, shift, left = shift_table(RADIUS_M, PAINT_M), np.zeros(3), []
    for point, direction, located in random_fingers(150, hidden=0.7):
        assert located_shift(table, located, direction, extrinsics(cameras), shift)
        left.append(split(located - shift - point, point))
    along, across = np.array(left).T
    # What is left is the coarse grid of the ray-casting here (.25 mm a ray) and that parallel rays
    # stand for a near camera's.
    assert np.sqrt(np.mean(along**2)) < 0.7e-3
    assert np.sqrt(np.mean(across**2)) < 0.2e-3


def test_any_number_of_cameras_agrees_on_the_shift():
    table, direction = shift_table(RADIUS_M, PAINT_M), np.array([0.3, -0.6, -0.74])
    direction /= np.linalg.norm(direction)
    shifts = []
    for cameras in (2, 4):
        rig = extrinsics(tuple(SyntheticRig(cameras=cameras).rig().values()))
        shift = np.zeros(3)
        assert located_shift(table, np.array([0.03, -0.05, 0.5]), direction, rig, shift)
        shifts.append(shift)
    np.testing.assert_allclose(shifts[0], shifts[1], atol=0.3e-3)
