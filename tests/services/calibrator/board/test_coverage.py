"""Coverage: which cells, which tilts, and the words for what is missing."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_x, transform
from services.calibrator.board.coverage import coverage


def test_cells_are_counted_and_empty_ones_named():
    corners = np.stack(
        np.meshgrid(np.linspace(330, 630, 10), np.linspace(10, 470, 10)), axis=-1
    ).reshape(-1, 2)
    seen = coverage((640, 480), [corners], [np.eye(4)])
    assert seen.share == pytest.approx(0.5)
    assert seen.missing == "top left, middle left, bottom left"
    assert seen.drawing().splitlines()[0].startswith(". . . . ")


def test_tilts_are_angles_to_the_image_plane_whichever_side_z_points_to():
    poses = [
        transform(rotation_x(np.radians(angle)), [0.0, 0.0, 0.5])
        for angle in (-20.0, 0.0, 35.0, 180.0)
    ]
    seen = coverage((640, 480), [np.array([[320.0, 240.0]])], poses)
    np.testing.assert_allclose(seen.tilt_deg, [20.0, 0.0, 35.0, 0.0], atol=1e-6)
    assert seen.normals_deg == pytest.approx(55.0)


def test_corners_outside_the_picture_count_at_its_edge():
    assert coverage((640, 480), [np.array([[-3.0, 500.0]])], []).counts[5][0] == 1
