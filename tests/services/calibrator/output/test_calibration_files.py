"""Calibration files: written, and read by rhot.files.calibration as every service does."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import load_cameras, load_lens, save
from rhot.geometry.transforms import apply
from services.calibrator.lens.calibrate import calibrate_lens
from services.calibrator.output.calibration_files import (
    lens_file,
    lens_vectors,
    rig_file,
    rig_lens_files,
)
from services.calibrator.rig.calibrate import calibrate_rig


@pytest.fixture(scope="module")
def calibrated(make_bench):
    """A bench, and the rig calibrated on it."""
    bench = make_bench(positions=8)
    return bench, calibrate_rig(bench.detections(0.05), bench.board)


def test_a_rig_is_read_back_as_cameras_that_see_the_board_where_it_was_seen(calibrated, tmp_path):
    bench, result = calibrated
    for name, lens in rig_lens_files(result, "2025-01-01", "pictures").items():
        save(tmp_path / f"{name}.lens.json", lens)
    save(tmp_path / "rig.json", rig_file(result, "2025-01-01", "pictures"))
    cameras = load_cameras(tmp_path, ["left", "right"])
    np.testing.assert_array_equal(cameras["left"].T_rig_from_camera, np.eye(4))
    points = apply(result.state.T_rig_from_board[0], bench.board.points)
    for camera in bench.cameras:
        np.testing.assert_allclose(
            cameras[camera.name].project(points), bench.corners(camera, "01"), atol=0.1
        )
    assert [path.name for path in sorted(tmp_path.iterdir())] == [
        "left.lens.json",
        "rig.json",
        "right.lens.json",
    ]


def test_files_say_how_they_were_made(calibrated):
    _, result = calibrated
    geometry = rig_file(result, "2025-01-01", "pictures")
    assert (geometry.date, geometry.tool) == ("2025-01-01", "rhot calibrate stereo")
    assert geometry.inputs["board"] == "chessboard 9x6"
    assert geometry.inputs["square_m"] == 0.025
    assert {
        "stereo_rms_px",
        "held_out_squares",
        "held_out_mm",
        "square_error_percent",
        "epipolar_px",
    } <= set(geometry.residuals)
    assert all(np.isfinite(value) for value in geometry.residuals.values())


def test_one_lens_is_read_back(make_bench, tmp_path):
    bench = make_bench(1, positions=8)
    result = calibrate_lens("left", bench.detections(0.05)["left"], bench.board)
    save(tmp_path / "left.lens.json", lens_file(result, bench.board, "2025-01-01", "pictures"))
    lens = load_lens(tmp_path, "left")
    assert lens.size_px == (640, 480)
    assert lens.matrix[0][0] == pytest.approx(result.lens[0], abs=1e-3)
    assert lens.residuals["held_out_mm"] == pytest.approx(
        25.0 * lens.residuals["held_out_squares"], rel=1e-3
    )


def test_a_lens_of_another_picture_size_is_refused(calibrated):
    bench, result = calibrated
    files = rig_lens_files(result, "", "")
    found = bench.detections()
    assert set(lens_vectors(files, found)) == {"left", "right"}
    other = {
        "left": {
            key: type(shown)(shown.ids, shown.corners, (1280, 960))
            for key, shown in found["left"].items()
        }
    }
    with pytest.raises(CalibrationError, match="calibrated at 640x480"):
        lens_vectors(files, other)
