"""The printed board: exact size, and found by the detector that will look for it."""

from __future__ import annotations

import re

import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.board.board_pattern import black_rectangles
from services.calibrator.board.board_pdf import PAPERS_MM, board_pdf
from services.calibrator.board.detect import detect

MM = 72.0 / 25.4


def raster(board: Board, per_mm: int = 4, margin_mm: int = 20) -> np.ndarray:
    """The board's rectangles as a picture."""
    side = 1e3 * board.square_m
    height, width = ((n + 1) * side + 2 * margin_mm for n in (board.rows, board.cols))
    page = np.full((round(height * per_mm), round(width * per_mm)), 235, dtype=np.uint8)
    for x, y, w, h in black_rectangles(board):
        left, top, right, bottom = (
            round((value + margin_mm) * per_mm) for value in (x, y, x + w, y + h)
        )
        page[top:bottom, left:right] = 20
    return page


@pytest.mark.parametrize(
    "board",
    [
        Board(9, 6, 0.025),
        Board(7, 5, 0.03, "charuco"),
        Board(6, 9, 0.02, "charuco", "DICT_5X5_50", 0.6),
    ],
)
def test_the_printed_board_is_found_at_its_size(board):
    found = detect(raster(board), board)
    assert found is not None
    assert len(found.ids) == board.size
    side_px = np.linalg.norm(found.corners[1] - found.corners[0])
    assert side_px == pytest.approx(4e3 * board.square_m, rel=2e-3)


def test_the_page_is_a_valid_pdf_of_exact_size():
    document = board_pdf(Board(9, 6, 0.025))
    assert document.startswith(b"%PDF-")
    assert document.rstrip().endswith(b"%%EOF")
    box = [float(value) for value in re.search(rb"/MediaBox \[([^]]+)\]", document)[1].split()]
    np.testing.assert_allclose(np.array(box[2:]) / MM, PAPERS_MM["a4"][::-1], atol=1e-3)
    table = int(re.search(rb"startxref\n(\d+)", document)[1])
    assert document[table:].startswith(b"xref")
    for number, place in enumerate(re.findall(rb"(\d{10}) 00000 n", document[table:]), start=1):
        assert document[int(place) :].startswith(b"%d 0 obj" % number)
    squares = [
        [float(v) for v in line.split()[:4]]
        for line in document.decode("latin-1").splitlines()
        if line.endswith(" re")
    ]
    assert len(squares) == 35
    np.testing.assert_allclose(np.array(squares)[:, 2:] / MM, 25.0, atol=1e-3)


def test_the_same_board_is_the_same_file():
    board = Board(7, 5, 0.03, "charuco")
    assert board_pdf(board) == board_pdf(board)


def test_a_board_too_large_for_the_paper_says_what_fits():
    with pytest.raises(CalibrationError, match=r"squares of 26\.5 mm do") as refused:
        board_pdf(Board(9, 6, 0.03))
    assert "letter" in str(refused.value)
    assert board_pdf(Board(9, 6, 0.0265))
    with pytest.raises(CalibrationError, match="use one of a4"):
        board_pdf(Board(9, 6, 0.02), "a7")
