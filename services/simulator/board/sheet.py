"""A printed calibration board as it lies on its paper: `rhot board`'s, chessboard or ChArUco. Pure.

The board's frame is the calibrator's: origin in the first inner corner, x along a row of corners, y
down the rows, z away from whoever looks at the printed side.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array

# What `rhot board` prints unless it is told otherwise: inner corners, side of a square, and of a
# ChArUco marker in squares; on A4.
COLS, ROWS, SQUARE_M = 9, 6, 0.025
_MARKER, _DICTIONARY = 0.7, cv2.aruco.DICT_4X4_50
_PAPER_M = (0.297, 0.210)
# Texels of a square: the six cells of a marker are seven texels each, so that nothing is resampled.
_TEXELS = 60
# Share of the light that printer's ink and paper send back.
INK, PAPER = 0.035, 0.80

BoardKind = Literal["chessboard", "charuco"]


class Sheet(NamedTuple):
    """The print: texels of 1 (paper) and 0 (ink), where they begin, and where the paper ends."""

    texels: npt.NDArray[np.uint8]  # (rows, columns)
    per_m: float
    first_m: Array  # (2,) x and y of the first texel's corner
    paper_m: Array  # (2, 2) its corners: least x and y, largest x and y


def middle_m() -> Array:
    """The middle of the board in its frame; (3,)."""
    return np.array([0.5 * (COLS - 1) * SQUARE_M, 0.5 * (ROWS - 1) * SQUARE_M, 0.0])


def outline(paper_m: Array, steps: int) -> Array:
    """Points along the paper's four edges in the board's frame; (4 * steps, 3)."""
    (x0, y0), (x1, y1) = paper_m
    corners = np.array([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])
    along = np.linspace(0.0, 1.0, steps, endpoint=False)[:, None]
    sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    return np.concatenate([(1.0 - along) * a + along * b for a, b in sides])


@lru_cache(maxsize=2)
def printed(kind: BoardKind) -> Sheet:
    """The print of that kind of board."""
    size = (COLS + 1, ROWS + 1)
    if kind == "charuco":
        dictionary = cv2.aruco.getPredefinedDictionary(_DICTIONARY)
        board = cv2.aruco.CharucoBoard(size, SQUARE_M, _MARKER * SQUARE_M, dictionary)
        picture = np.asarray(board.generateImage((size[0] * _TEXELS, size[1] * _TEXELS)))
        texels = (picture > 127).astype(np.uint8)
    else:
        rows, columns = np.indices((size[1], size[0]))
        squares = ((rows + columns) % 2).astype(np.uint8)
        texels = np.kron(squares, np.ones((_TEXELS, _TEXELS), np.uint8))
    middle, half = middle_m()[:2], 0.5 * np.array(_PAPER_M)
    return Sheet(
        np.ascontiguousarray(texels),
        _TEXELS / SQUARE_M,
        np.array([-SQUARE_M, -SQUARE_M]),
        np.stack([middle - half, middle + half]),
    )
