"""Real stereo pairs of a 9x6 board (mexopencv's test data): the figures that issue 4 asks for."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.board.find_boards import determine_board, find_boards
from services.calibrator.board.picture_folder import PictureSet, find_pictures
from services.calibrator.rig.calibrate import calibrate_rig


@pytest.fixture(scope="module")
def pictures(rhot_data) -> PictureSet:
    """The pairs."""
    folder = rhot_data / "stereo_chessboard"
    if not folder.is_dir():
        pytest.skip(f"no {folder}; set RHOT_DATA to the folder of real recordings")
    return find_pictures(folder)


def test_the_real_pairs_are_calibrated_to_the_limit(pictures):
    assert pictures.cameras == ["left", "right"]
    board = determine_board(pictures, None, 1.0)
    assert (board.cols, board.rows) == (9, 6)
    found, blind = find_boards(pictures, board)
    assert not blind
    assert all(len(detections) == 13 for detections in found.values())
    result = calibrate_rig(found, board)
    assert result.rms_px <= 0.19
    assert result.held_out_squares <= 0.0115
    assert abs(result.square_ratio - 1.0) < 0.001
    assert abs(result.square_worst - 1.0) < 0.005
    assert result.epipolar_px < 0.13
    assert not result.left_out
    # The baseline in squares, as every calibration of these pairs in the literature's tools finds
    # it.
    assert np.linalg.norm(result.state.T_camera_from_rig[1][:3, 3]) == pytest.approx(3.33, abs=0.02)
