"""From pictures to boards: what is found, what is counted, what is noted."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.board.detect import charuco_board
from services.calibrator.board.find_boards import determine_board, find_boards, larger_board_note
from services.calibrator.board.picture_folder import PictureSet, find_pictures


@pytest.fixture(scope="module")
def pictures(make_bench, tmp_path_factory) -> PictureSet:
    """Three pairs of a 7x5 board, and one picture without."""
    bench = make_bench(positions=3, board=Board(7, 5, 0.03), size_px=(400, 300), focal_px=330.0)
    folder = tmp_path_factory.mktemp("pairs")
    for camera in bench.cameras:
        for key in bench.poses:
            cv2.imwrite(str(folder / f"{camera.name}{key}.png"), bench.picture(camera, key))
    cv2.imwrite(str(folder / "right4.png"), np.full((300, 400), 90, dtype=np.uint8))
    return find_pictures(folder)


def test_boards_are_found_and_pictures_without_are_listed(pictures):
    advanced: list[int] = []
    found, blind = find_boards(pictures, Board(7, 5, 0.03), advanced.append)
    assert {camera: list(each) for camera, each in found.items()} == {
        "left": ["1", "2", "3"],
        "right": ["1", "2", "3"],
    }
    assert [(item.camera, item.key) for item in blind] == [("right", "4")]
    assert sum(advanced) == 7


def test_the_board_is_counted_if_it_is_not_given(pictures):
    assert determine_board(pictures, None, 0.03) == Board(7, 5, 0.03)
    given = Board(6, 4, 0.03)
    assert determine_board(pictures, given, 0.03) is given
    assert "7x5 inner corners" in larger_board_note(pictures, given)
    assert larger_board_note(pictures, Board(7, 5, 0.03)) == ""


def test_the_pattern_of_a_charuco_board_is_found_out(tmp_path):
    """Test: pictures of a board printed by OpenCV before 4.6.

    Expected: the old pattern, although the new one was asked for.
    """
    board = Board(4, 5, 0.03, "charuco", legacy=True)
    for n in range(2):
        flat = charuco_board(board).generateImage((300 + 20 * n, 360 + 24 * n), marginSize=20)
        cv2.imwrite(str(tmp_path / f"left{n}.png"), flat)
    pictures = PictureSet({"left": {path.stem: path for path in sorted(tmp_path.iterdir())}})
    assert determine_board(pictures, Board(4, 5, 0.03, "charuco"), 0.03) == board
    found, _ = find_boards(pictures, board)
    assert all(len(detection.ids) == 20 for detection in found["left"].values())


def test_no_board_anywhere_is_refused_with_what_to_do(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.full((60, 80), 90, dtype=np.uint8))
    with pytest.raises(CalibrationError, match="--board COLSxROWS"):
        determine_board(PictureSet({"left": {"a": tmp_path / "a.png"}}), None, 0.025)
