"""Points in a picture: those that the lens shows, and no others."""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import Camera, pinhole
from services.cli.plot.overlay.projection import pixels_of


def test_points_that_a_lens_does_not_show_are_left_out():
    barrel = np.array([-0.35, 0.1, 0.0, 0.0, 0.0])
    camera = Camera("left", (640, 480), pinhole((640, 480), 1.2), barrel, np.eye(4))
    points = np.array([[0.0, 0.0, 0.5], [0.1, -0.1, 0.5], [3.0, 0.0, 0.5], [0.0, 0.0, -0.5]])
    # The polynomial takes the third one, 80 deg off the axis, back to somewhere.
    assert np.isfinite(camera.project(points)[2]).all()
    pixels = pixels_of(camera, points)
    assert np.array_equal(pixels[:2], camera.project(points[:2]))
    assert np.isnan(pixels[2:]).all()
