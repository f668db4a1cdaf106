"""`rhot calibrate refine` as a user types it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import CameraPlace, Lens, Matrix4, RigGeometry, load_cameras, save
from rhot.files.capture import write_lines
from rhot.geometry.transforms import Array, rotation_x, transform
from testing.synthetic_points import MovingHand, SyntheticRig, frames


def rows(matrix: Array) -> Matrix4:
    return tuple(tuple(row) for row in matrix.tolist())


def test_refine_writes_the_places_that_a_hand_tells(run_calibrate, rig_toml, tmp_path):
    """The right camera stands half a degree and 2 mm off its rig.json.

    The report says so, and services read the new file.
    """
    setup = SyntheticRig(sigma_px=0.15)
    true = setup.rig()
    off = transform(rotation_x(np.radians(0.5)), (0.0, 0.002, 0.0))
    calibration = tmp_path / "calibration"
    places = {}
    for name, camera in true.items():
        distortion = tuple(camera.distortion.tolist())
        lens = Lens(size_px=camera.size_px, matrix=rows(camera.matrix), distortion=distortion)
        save(calibration / f"{name}.lens.json", lens)
        T = camera.T_rig_from_camera @ off if name == "right" else camera.T_rig_from_camera
        places[name] = CameraPlace(T_rig_from_camera=rows(T))
    save(calibration / "rig.json", RigGeometry(cameras=places))
    path = MovingHand(distance_m=0.6, speed_m_s=0.6, hand_hz=(0.2, 0.6))
    write_lines(tmp_path / "markers.jsonl", frames(setup, path, 8.0))
    result = run_calibrate("refine", tmp_path, "--config", rig_toml)
    assert result.exit_code == 0
    assert "held-out epipolar" in result.stdout
    assert "camera right: turned about its x, y, z by -0.50" in result.stdout
    found = load_cameras(calibration, ["left", "right"])["right"].T_rig_from_camera
    np.testing.assert_allclose(found[:3, :3], true["right"].T_rig_from_camera[:3, :3], atol=1e-3)
    written = json.loads((calibration / "rig.json").read_text())
    assert written["residuals"]["epipolar_before_px"] > 3.0


def test_refine_explains_a_wand_it_does_not_understand(run_calibrate, rig_toml, tmp_path):
    with pytest.raises(CalibrationError, match="write two colours"):
        run_calibrate("refine", tmp_path, "--config", rig_toml, "--wand", "blue-green")
