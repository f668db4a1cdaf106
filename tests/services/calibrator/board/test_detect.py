"""Boards found in rendered pictures, and not found where there is none."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from services.calibrator.board.board import Board
from services.calibrator.board.board_size import find_board_size
from services.calibrator.board.detect import as_grey, charuco_board, detect


@pytest.mark.parametrize("size_px", [(640, 480), (320, 240)])
def test_a_chessboard_is_found_and_numbered(make_bench, size_px):
    bench = make_bench(positions=2, size_px=size_px, focal_px=0.82 * size_px[0])
    for key in bench.poses:
        found = detect(bench.picture(bench.cameras[0], key), bench.board)
        assert found is not None
        assert found.size_px == size_px
        error = found.corners - bench.corners(bench.cameras[0], key)
        assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.1


def test_a_large_picture_is_searched_small_and_refined_large(make_bench):
    bench = make_bench(positions=1, size_px=(1400, 1050), focal_px=1154.0)
    found = detect(
        bench.picture(bench.cameras[0], "01", blur_px=2.0, fine=1), bench.board, quick=True
    )
    assert found is not None
    assert (
        np.sqrt(
            np.mean(np.sum((found.corners - bench.corners(bench.cameras[0], "01")) ** 2, axis=1))
        )
        < 0.1
    )


def test_a_board_cut_off_by_the_edge_is_not_found(make_bench):
    bench = make_bench(positions=1)
    picture = bench.picture(bench.cameras[0], "01")
    middle = round(float(bench.corners(bench.cameras[0], "01")[:, 0].mean()))
    assert detect(picture[:, :middle], bench.board) is None


def test_noise_and_plain_pictures_hold_no_board():
    noise = np.random.default_rng(0).integers(0, 255, (240, 320), dtype=np.uint8)
    assert detect(noise, Board(9, 6, 0.025)) is None
    assert detect(np.zeros((240, 320, 3), dtype=np.uint8), Board(9, 6, 0.025)) is None
    assert detect(noise, Board(7, 5, 0.03, "charuco")) is None


def test_colour_pictures_become_grey():
    assert as_grey(np.zeros((4, 6, 3), dtype=np.uint8)).shape == (4, 6)
    assert as_grey(np.zeros((4, 6, 1), dtype=np.uint8)).shape == (4, 6)


@pytest.mark.parametrize("legacy", [False, True])
def test_a_part_of_a_charuco_board_is_found_with_its_own_numbers(legacy):
    """Test: the left half of a ChArUco board seen obliquely.

    Expected: its corners under the numbers they have on the whole board.
    """
    board = Board(7, 5, 0.03, "charuco", legacy=legacy)
    flat = charuco_board(board).generateImage((800, 600), marginSize=0)
    H = np.array([[0.62, -0.08, 60.0], [0.05, 0.60, 40.0], [1e-4, 5e-5, 1.0]])
    picture = cv2.warpPerspective(flat, H, (640, 480), flags=cv2.INTER_AREA, borderValue=255)
    true = cv2.perspectiveTransform(
        (100.0 * (board.grid + 1.0) - 0.5).reshape(-1, 1, 2), H
    ).reshape(-1, 2)
    picture[:, 330:] = 128
    found = detect(picture, board)
    assert found is not None
    assert 8 <= len(found.ids) < 30
    assert np.abs(found.corners - true[found.ids]).max() < 0.6
    assert np.sqrt(np.mean((found.corners - true[found.ids]) ** 2)) < 0.2


@pytest.mark.parametrize("size", [(9, 6), (7, 7), (5, 4), (11, 8)])
def test_the_size_of_a_board_is_counted(make_bench, size):
    bench = make_bench(positions=4, board=Board(*size, 0.2 / size[0]))
    assert find_board_size(bench.picture(bench.cameras[0], key) for key in bench.poses) == size


def test_without_a_board_there_is_no_size():
    assert find_board_size([np.full((240, 320), 100, dtype=np.uint8)]) is None
