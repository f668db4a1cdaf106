"""`rhot calibrate world` as a user types it."""

from __future__ import annotations

import tomllib

import cv2
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.geometry.transforms import rotation_x, transform
from testing.synthetic_boards import Bench


def test_world_prints_the_table_for_rig_toml(run_calibrate, board_pictures, rig_toml, tmp_path):
    """Test: calibrate, then a board on the desk.

    Expected: [rig.world] with the camera above the desk.
    """
    bench, pictures = board_pictures
    board = ("--board", "9x6", "--square", 0.025)
    run_calibrate("stereo", pictures, *board, "--config", rig_toml)
    desk = tmp_path / "desk"
    desk.mkdir()
    lying = transform(rotation_x(np.radians(-40.0)), [-0.08, -0.02, 0.5])
    scene = Bench(bench.cameras, bench.board, {"desk": lying})
    for camera in bench.cameras:
        cv2.imwrite(str(desk / f"{camera.name}.png"), scene.picture(camera, "desk"))
    result = run_calibrate("world", desk, "--config", rig_toml, *board)
    T = np.array(tomllib.loads(result.stdout)["rig"]["world"]["T_rig_from_camera"])
    truth = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(lying)
    np.testing.assert_allclose(T[:3, 3], truth[:3, 3], atol=4e-3)
    with pytest.raises(CalibrationError, match="holds no pictures"):
        run_calibrate("world", tmp_path / "calibration", "--config", rig_toml)
