"""Places of a board: whole in all pictures, and such that a calibration learns from them."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, apply, inverse
from services.simulator.board.carried import CarriedBoard
from services.simulator.board.places import place
from services.simulator.board.sheet import COLS, ROWS, SQUARE_M
from services.simulator.scene.scene import Scene

CORNERS = np.array([(x, y, 0) for y in range(ROWS) for x in range(COLS)]) * SQUARE_M


def seen(camera: Camera, T: Array) -> Array:
    return camera.project(apply(T, CORNERS))


@pytest.mark.parametrize("names", [["left"], ["left", "right"]])
def test_every_place_is_whole_in_the_pictures_and_they_differ(
    fist: Scene, names: list[str]
) -> None:
    cameras = [fist.cameras[name] for name in names]
    poses = [place(cameras, number, 1) for number in range(19)]
    for camera in cameras:
        pixels = np.array([seen(camera, T) for T in poses])
        assert pixels.min() > 5.0
        assert (pixels.max(axis=(0, 1)) < np.array(camera.size_px) - 5.0).all()
        covered = np.ptp(pixels, axis=(0, 1)) / camera.size_px
        assert covered.min() > 0.7
        ahead = np.array([(inverse(camera.T_rig_from_camera) @ T)[2, 2] for T in poses])
        assert np.rad2deg(np.arccos(ahead[1:])).min() > 10.0, "tilted"
    np.testing.assert_array_equal(poses[7], place(cameras, 7, 1))


def test_it_is_carried_without_a_jump_and_held_still(fist: Scene) -> None:
    cameras = list(fist.cameras.values())
    here, there = place(cameras, 0, 1), place(cameras, 3, 1)
    board = CarriedBoard("chessboard", here)
    board.carry(there, 10.0)
    np.testing.assert_array_equal(board.pose(9.0), here)
    path = np.array([board.pose(t)[:3, 3] for t in np.arange(9.9, 11.0, 0.01)])
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() < 0.01
    np.testing.assert_allclose(board.pose(10.8), there, atol=1e-12)
