"""Boards: their points, their neighbours, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board, parse_corners, square_doubt, square_note


def test_points_run_along_rows_in_metres():
    board = Board(4, 3, 0.02)
    assert board.points.shape == (12, 3)
    np.testing.assert_allclose(board.points[1], [0.02, 0.0, 0.0])
    np.testing.assert_allclose(board.points[4], [0.0, 0.02, 0.0])
    assert board.name == "chessboard 4x3, 20 mm squares"


def test_neighbours_do_not_wrap_around_a_row_and_skip_unseen_corners():
    board = Board(4, 3, 0.02)
    all_pairs = {tuple(pair) for pair in board.neighbours(np.arange(12)).tolist()}
    assert len(all_pairs) == 3 * 3 + 4 * 2
    assert (3, 4) not in all_pairs
    assert board.neighbours(np.array([0, 5, 10])).shape == (0, 2)
    assert board.neighbours(np.array([2, 3])).tolist() == [[0, 1]]


@pytest.mark.parametrize("text", ["9x6", " 9 x 6 ", "9X6", "9,6"])
def test_corners_are_read(text):
    assert parse_corners(text) == (9, 6)


@pytest.mark.parametrize("text", ["9", "9x", "ninexsix", "9x6x2", "-9x6"])
def test_other_texts_are_refused_with_an_example(text):
    with pytest.raises(CalibrationError, match="--board 9x6"):
        parse_corners(text)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"cols": 2, "rows": 6, "square_m": 0.025}, "inner corners"),
        ({"cols": 9, "rows": 60, "square_m": 0.025}, "inner corners"),
        ({"cols": 9, "rows": 6, "square_m": 25.0}, "in metres"),
        ({"cols": 9, "rows": 6, "square_m": float("nan")}, "in metres"),
        ({"cols": 9, "rows": 6, "square_m": 0.025, "marker": 1.2}, "--marker 0.7"),
        ({"cols": 9, "rows": 6, "square_m": 0.025, "dictionary": "DICT_7"}, "DICT_4X4_50"),
        ({"cols": 13, "rows": 9, "square_m": 0.02, "kind": "charuco"}, "70 markers"),
    ],
)
def test_impossible_boards_are_refused_with_what_is_possible(arguments, reason):
    with pytest.raises(CalibrationError, match=reason):
        Board(**arguments)


@pytest.mark.parametrize("square_m", [0.005, 0.02501, 0.1])
def test_squares_that_people_hold_are_no_doubt(square_m):
    assert square_doubt(square_m) == ""
    assert square_note(square_m) == ""


@pytest.mark.parametrize(
    ("square_m", "meant"),
    [(0.25, "0.025"), (0.0025, "0.025"), (2.4, "0.024"), (25.0, "0.025"), (0.3, "0.03")],
)
def test_a_slip_of_the_square_is_told_with_what_may_be_meant(square_m, meant):
    assert f"would be --square {meant}" in square_doubt(square_m)


def test_squares_of_one_have_no_unit():
    assert square_doubt(1.0) == ""
    assert "in squares" in square_note(1.0)
