"""One order of a chessboard's corners, whoever detected them and however the board was held. Pure.

A detector may begin at any of the board's corners. Two rules settle it. Rows and columns turn the
same way as on the printed side, never mirrored. And where the colours tell the two ends of the
board apart (one of cols and rows is even, the other odd), the square beyond the first corner is
black. Where they do not, several numberings are equally right for one camera, and
rig/relative_pose.py chooses the one on which the cameras agree.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board


def rotated_numberings(cols: int, rows: int) -> list[np.ndarray]:
    """Each numbering (n,) of a grid that turning the board could cause; the first is the identity.

    corners[numbering] are the corners as the turned board numbers them. Two numberings, or four for
    a square grid.
    """
    numbers = np.arange(cols * rows).reshape(rows, cols)
    quarter_turns = 1 if cols == rows else 2
    return [np.rot90(numbers, k).reshape(-1) for k in range(0, 4, quarter_turns)]


def possible_numberings(board: Board) -> list[np.ndarray]:
    """The numberings (n,) a detection may be meant in; the markers of ChArUco leave no doubt."""
    if board.kind == "charuco":
        return [np.arange(board.size)]
    return rotated_numberings(board.cols, board.rows)


def mirrored_numbering(cols: int, rows: int) -> np.ndarray:
    """The numbering (n,) of a grid that is seen in a mirror: columns run backwards."""
    return np.arange(cols * rows).reshape(rows, cols)[:, ::-1].reshape(-1)


def canonical_order(image: np.ndarray, cols: int, rows: int, corners: Array) -> Array:
    """Corners (n, 2) of a chessboard in a grey picture (h, w), in the order of the two rules."""
    if _signed_area(cols, rows, corners) < 0.0:
        corners = corners[mirrored_numbering(cols, rows)]
    if (cols + rows) % 2 and _first_square_is_white(image, cols, rows, corners):
        corners = corners[rotated_numberings(cols, rows)[1]]
    return corners


def _signed_area(cols: int, rows: int, corners: Array) -> float:
    """Twice the signed area of the outline, positive where x to y turns as in the picture."""
    grid = corners.reshape(rows, cols, 2)
    outline = np.array([grid[0, 0], grid[0, -1], grid[-1, -1], grid[-1, 0]])
    following = np.roll(outline, -1, axis=0)
    return float(np.sum(outline[:, 0] * following[:, 1] - outline[:, 1] * following[:, 0]))


def _first_square_is_white(image: np.ndarray, cols: int, rows: int, corners: Array) -> bool:
    """Whether the square beyond the first corner is white, voted by all squares between corners.

    The square diagonally inside the first corner has the same colour.
    """
    grid = corners.reshape(rows, cols, 2)
    centres = 0.25 * (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:])
    height, width = image.shape
    x = np.clip(np.round(centres[..., 0]).astype(np.int64), 0, width - 1)
    y = np.clip(np.round(centres[..., 1]).astype(np.int64), 0, height - 1)
    brightness = image[y, x].astype(np.float64)
    sign = 1.0 - 2.0 * (np.add.outer(np.arange(rows - 1), np.arange(cols - 1)) % 2)
    # Shadows fall across the board: each square is compared with the mean of its row.
    contrast = brightness - brightness.mean(axis=1, keepdims=True)
    return float(np.sum(contrast * sign)) > 0.0
