"""The printed pattern of a board: its black parts as rectangles in mm. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from services.calibrator.board.board import Board
from services.calibrator.board.detect import charuco_board


class Rectangle(NamedTuple):
    """A black rectangle in mm; x and y of its top left corner from the board's, y down."""

    x: float
    y: float
    width: float
    height: float


def pattern_size_mm(board: Board) -> tuple[float, float]:
    """Width and height of all squares together, in mm."""
    side_mm = 1e3 * board.square_m
    return (board.cols + 1) * side_mm, (board.rows + 1) * side_mm


def black_rectangles(board: Board) -> Iterator[Rectangle]:
    """All that is black on the board."""
    side_mm = 1e3 * board.square_m
    if board.kind == "charuco":
        yield from _charuco_rectangles(board, side_mm)
        return
    for row in range(board.rows + 1):
        for col in range(board.cols + 1):
            if (row + col) % 2 == 0:
                yield Rectangle(col * side_mm, row * side_mm, side_mm, side_mm)


def _charuco_rectangles(board: Board, side_mm: float) -> Iterator[Rectangle]:
    """The squares without a marker, and the black cells of the markers."""
    described = charuco_board(board)
    marker_mm = board.marker * side_mm
    marker_corners = [
        1e3 * np.asarray(points, dtype=np.float64).reshape(-1, 3)[:, :2].min(axis=0)
        for points in described.getObjPoints()
    ]
    marker_centres = (corner + 0.5 * marker_mm for corner in marker_corners)
    white_squares = {(int(y // side_mm), int(x // side_mm)) for x, y in marker_centres}
    for row in range(board.rows + 1):
        for col in range(board.cols + 1):
            if (row, col) not in white_squares:
                yield Rectangle(col * side_mm, row * side_mm, side_mm, side_mm)
    dictionary = described.getDictionary()
    # The bits of a marker have a black border of one cell.
    cells = dictionary.markerSize + 2
    cell_mm = marker_mm / cells
    numbers = np.asarray(described.getIds()).reshape(-1)
    for number, (x, y) in zip(numbers, marker_corners, strict=True):
        picture = np.asarray(dictionary.generateImageMarker(int(number), cells))
        for row in range(cells):
            for begin, end in _runs(picture[row] == 0):
                width = (end - begin) * cell_mm
                yield Rectangle(x + begin * cell_mm, y + row * cell_mm, width, cell_mm)


def _runs(black: np.ndarray) -> Iterator[tuple[int, int]]:
    """Begin and end of every run of True in a row of cells (n,).

    One rectangle for a run leaves no hairline between its cells.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], black.astype(np.int8), [0]])))
    yield from ((int(begin), int(end)) for begin, end in edges.reshape(-1, 2))
