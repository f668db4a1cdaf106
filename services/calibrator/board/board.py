"""Calibration boards, chessboard and ChArUco, as points in the board's own frame. Pure.

The board frame: origin in the first inner corner, x along a row of corners, y down the rows, z away
from whoever looks at the printed side, metres. A board is counted in inner corners, the points
where black squares touch. An impossible board is a CalibrationError that says what is possible.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array

BoardKind = Literal["chessboard", "charuco"]

# Dictionaries of ChArUco markers: OpenCV's name, and how many markers it has.
DICTIONARIES = {
    "DICT_4X4_50": 50,
    "DICT_4X4_100": 100,
    "DICT_4X4_250": 250,
    "DICT_5X5_50": 50,
    "DICT_5X5_100": 100,
    "DICT_5X5_250": 250,
    "DICT_6X6_250": 250,
    "DICT_APRILTAG_36H11": 587,
}
# OpenCV's detector needs three. A board of more than forty on one page has squares that no camera
# resolves.
_MIN_CORNERS, _MAX_CORNERS = 3, 40
# Squares of 1 mm are beyond a printer, squares of 2 m beyond a desk: such a number is in
# millimetres, or a slip.
_MIN_SQUARE_M, _MAX_SQUARE_M = 0.001, 2.0
# Squares of boards that are held in a hand. Others are a slip more often than not: a zero more or
# less, centimetres or millimetres for metres, metres for centimetres.
_HELD_M, _SLIPS = (0.005, 0.1), (0.1, 10.0, 0.01, 0.001, 100.0)
# What a held board's squares usually measure.
_USUAL_M = 0.025
# Sides of a marker in squares: a smaller one has too few pixels to be decoded, a larger one comes
# too near the corners.
_MIN_MARKER, _MAX_MARKER = 0.3, 0.9


@dataclass(frozen=True)
class Board:
    """A flat board of cols x rows inner corners, square_m apart.

    marker is the side of a ChArUco marker in squares. A ChArUco board of cols x rows inner corners
    has (cols + 1) x (rows + 1) squares. legacy is the pattern of OpenCV before 4.6, which differs
    where the number of rows of squares is even.
    """

    cols: int
    rows: int
    square_m: float
    kind: BoardKind = "chessboard"
    dictionary: str = "DICT_4X4_50"
    marker: float = 0.7
    legacy: bool = False

    def __post_init__(self) -> None:
        if min(self.cols, self.rows) < _MIN_CORNERS or max(self.cols, self.rows) > _MAX_CORNERS:
            raise CalibrationError(
                f"a board of {self.cols}x{self.rows} inner corners cannot be used; both numbers "
                f"must be {_MIN_CORNERS}..{_MAX_CORNERS}. Inner corners are the points where black "
                "squares touch: one less than the squares each way"
            )
        if not _MIN_SQUARE_M <= self.square_m <= _MAX_SQUARE_M:
            raise CalibrationError(
                f"squares of {self.square_m:g} m cannot be right; give the side of one square in "
                f"metres, {_MIN_SQUARE_M:g}..{_MAX_SQUARE_M:g}"
                f"{_meant_text(self.square_m) or ', e.g. --square 0.025'}"
            )
        if not _MIN_MARKER <= self.marker <= _MAX_MARKER:
            raise CalibrationError(
                f"markers of {self.marker:g} squares cannot be used; give "
                f"{_MIN_MARKER:g}..{_MAX_MARKER:g}, e.g. --marker 0.7"
            )
        if self.dictionary not in DICTIONARIES:
            raise CalibrationError(
                f"dictionary {self.dictionary!r} is not known; use one of {', '.join(DICTIONARIES)}"
            )
        markers = (self.cols + 1) * (self.rows + 1) // 2
        if self.kind == "charuco" and markers > DICTIONARIES[self.dictionary]:
            raise CalibrationError(
                f"a ChArUco board of {self.cols}x{self.rows} inner corners has {markers} markers, "
                f"{self.dictionary} only {DICTIONARIES[self.dictionary]}; use a larger dictionary: "
                f"{', '.join(DICTIONARIES)}"
            )

    @property
    def size(self) -> int:
        """Number of inner corners."""
        return self.cols * self.rows

    @property
    def grid(self) -> Array:
        """Column and row of every corner, in the order of their numbers; (n, 2)."""
        column = np.tile(np.arange(self.cols), self.rows)
        row = np.repeat(np.arange(self.rows), self.cols)
        return np.stack([column, row], axis=1).astype(np.float64)

    @property
    def points(self) -> Array:
        """The corners in the board frame, metres; (n, 3)."""
        return np.concatenate([self.grid * self.square_m, np.zeros((self.size, 1))], axis=1)

    @property
    def name(self) -> str:
        """How people write it: `chessboard 9x6, 25 mm squares`."""
        return f"{self.kind} {self.cols}x{self.rows}, {1e3 * self.square_m:g} mm squares"

    def neighbours(self, ids: np.ndarray) -> np.ndarray:
        """Pairs (k, 2) int of positions in `ids` whose corners are neighbours on the board."""
        position_of = {int(corner): position for position, corner in enumerate(ids)}
        pairs = []
        for corner, position in position_of.items():
            right, below = corner + 1, corner + self.cols
            if right % self.cols and right in position_of:
                pairs.append((position, position_of[right]))
            if below in position_of:
                pairs.append((position, position_of[below]))
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def parse_corners(text: str) -> tuple[int, int]:
    """Columns and rows of a text such as `9x6`; raises CalibrationError for any other text."""
    match = re.fullmatch(r"\s*(\d{1,3})\s*[xX×,]\s*(\d{1,3})\s*", text)
    if not match:
        raise CalibrationError(
            f"board {text!r} is not understood; write its inner corners as COLSxROWS, "
            "e.g. --board 9x6"
        )
    return int(match[1]), int(match[2])


def square_doubt(square_m: float) -> str:
    """What is unusual about squares of that side, as a sentence; empty if nothing is.

    A calibration cannot tell its own scale: with squares ten times too large all figures are as
    good, and every distance is ten times too long.
    """
    if square_m == 1.0 or _HELD_M[0] <= square_m <= _HELD_M[1]:
        return ""
    return (
        f"squares of {length_text(square_m)} are not those of a board that is held in the hand "
        f"({range_text(_HELD_M)}); --square is in metres{_meant_text(square_m)}"
    )


def square_note(square_m: float) -> str:
    """What to say of squares of 1: lengths without a unit."""
    if square_m != 1.0:
        return ""
    return "--square 1: every length of the result is in squares, not in metres"


def length_text(metres: float) -> str:
    """A length in the unit in which it is easily read: `2.5 mm`, `250 mm`, `3.3 m`."""
    return f"{1e3 * metres:.3g} mm" if metres < 1.0 else f"{metres:.3g} m"


def range_text(limits_m: tuple[float, float]) -> str:
    """Two lengths: `5 mm to 100 mm`."""
    return f"{length_text(limits_m[0])} to {length_text(limits_m[1])}"


def _meant_text(square_m: float) -> str:
    """The side nearest to the usual one of those that slips of units and of a zero make of this."""
    held = [square_m * factor for factor in _SLIPS if _HELD_M[0] <= square_m * factor <= _HELD_M[1]]
    if not held:
        return ""
    best = min(held, key=lambda side: max(side / _USUAL_M, _USUAL_M / side))
    return f", so {length_text(best)} would be --square {best:g}"
