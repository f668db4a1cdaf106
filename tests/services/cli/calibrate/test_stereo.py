"""`rhot calibrate stereo` as a user types it."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import load_cameras


@pytest.fixture
def blank(tmp_path_factory):
    """Pairs of grey pictures."""
    folder = tmp_path_factory.mktemp("blank")
    for name in ("left1", "left2", "right1", "right2"):
        cv2.imwrite(str(folder / f"{name}.png"), np.full((120, 160), 90, dtype=np.uint8))
    return folder


def test_stereo_writes_what_services_read(run_calibrate, board_pictures, tmp_path):
    bench, pictures = board_pictures
    out = tmp_path / "calibration"
    result = run_calibrate("stereo", pictures, "--square", 0.025, "--out", out)
    assert result.exit_code == 0
    assert "held-out board fit" in result.stdout
    assert "chessboard 9x6, 25 mm squares" in result.stdout
    assert "left out: left 99: does not show the whole board" in result.stdout
    cameras = load_cameras(out, ["left", "right"])
    np.testing.assert_allclose(cameras["right"].centre_rig, bench.cameras[1].centre_rig, atol=1e-3)
    assert cameras["left"].focal_px[0] == pytest.approx(330.0, rel=5e-3)


def test_stereo_says_when_the_squares_were_assumed_and_prints_json(
    run_calibrate, board_pictures, tmp_path
):
    _, pictures = board_pictures
    command = ("stereo", pictures, "--board", "9x6", "--out", tmp_path, "--json")
    result = run_calibrate(*command)
    assert json.loads(result.stdout)["inputs"]["square_m"] == 0.025
    assert "25 mm were assumed" in result.stderr
    again = run_calibrate(*command, "--square", 0.05, "--keep-lenses")
    residuals = json.loads(again.stdout)["residuals"]
    assert residuals["square_mm"] == pytest.approx(50.0, rel=5e-3)
    baseline_m = np.linalg.norm(load_cameras(tmp_path, ["right"])["right"].centre_rig)
    assert baseline_m == pytest.approx(0.15, rel=0.02)


def test_refused_data_write_nothing(run_calibrate, board_pictures, blank, tmp_path):
    _, pictures = board_pictures
    with pytest.raises(CalibrationError, match="no picture of 'left', 'right' shows the board"):
        run_calibrate("stereo", blank, "--board", "9x6", "--out", tmp_path)
    with pytest.raises(CalibrationError, match="no picture shows a chessboard"):
        run_calibrate("stereo", blank, "--out", tmp_path)
    with pytest.raises(CalibrationError, match="in metres"):
        run_calibrate("stereo", pictures, "--board", "9x6", "--square", 25, "--out", tmp_path)
    with pytest.raises(CalibrationError, match="--config"):
        run_calibrate("stereo", pictures, "--live", "--out", tmp_path)
    with pytest.raises(CalibrationError, match="give its inner corners"):
        run_calibrate("lens", "left", pictures, "--kind", "charuco", "--out", tmp_path)
    assert not list(tmp_path.iterdir())
