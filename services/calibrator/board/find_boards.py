"""From a folder of pictures to the boards found in them: what both calibrations begin with. Pure
but for reading the files.

Pictures without a whole board are listed with that reason; a folder without any board is refused by
the calibration itself, or here if the board's size had to be found out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.board.board_size import guess_corners
from services.calibrator.board.detect import Detection, detect
from services.calibrator.board.picture_folder import PictureSet
from services.calibrator.bundle.views import LeftOut

Found = dict[str, dict[str, Detection]]
Advance = Callable[[int], None]
# Pictures in which a board's size is counted to compare it with the given one.
_LOOKS = 4
# Pictures searched thoroughly where quick detectors found nothing in any.
_TRIES = 3


def find_boards(
    pictures: PictureSet, board: Board, advance: Advance = lambda _: None
) -> tuple[Found, list[LeftOut]]:
    """The board in every picture (camera -> key -> detection), and the pictures that do not show it
    as a whole.
    """
    seen: dict[tuple[str, str], Detection | None] = {}
    for camera, files in pictures.files.items():
        for key in files:
            seen[camera, key] = detect(pictures.read(camera, key), board, quick=True)
            advance(1)
    missed = [place for place, detection in seen.items() if detection is None]
    # Where the quick detectors find nothing at all, it is the wrong board: a few pictures searched
    # thoroughly tell as much.
    for camera, key in missed if len(missed) < len(seen) else missed[:_TRIES]:
        seen[camera, key] = detect(pictures.read(camera, key), board)
    found: Found = {
        camera: {key: shown for key in files if (shown := seen[camera, key])}
        for camera, files in pictures.files.items()
    }
    blind = [
        LeftOut(camera, key, "does not show the whole board")
        for (camera, key), shown in seen.items()
        if shown is None
    ]
    return found, blind


def the_board(pictures: PictureSet, board: Board | None, square_m: float) -> Board:
    """The board, counted in the pictures if it is not given, with the ChArUco pattern that these
    pictures show.

    Raises CalibrationError if no picture shows a chessboard.
    """
    if board is not None:
        return _pattern(pictures, board) if board.kind == "charuco" else board
    size = guess_corners(_sample(pictures))
    if size is None:
        raise CalibrationError(
            "no picture shows a chessboard as a whole, so its size cannot be found out; give it with --board COLSxROWS (inner corners), "
            "or --kind charuco for a board with markers. It must be in focus, evenly lit, and completely in the picture with a white margin"
        )
    return Board(*size, square_m)


def larger_board(pictures: PictureSet, board: Board) -> str:
    """A note if the pictures show a larger chessboard than the one looked for; empty if not.

    A part of a board calibrates, but every picture may show another part, and the outer corners are
    lost.
    """
    if board.kind == "charuco":
        return ""
    size = guess_corners(image for _, image in zip(range(_LOOKS), _sample(pictures), strict=False))
    if size is None or size[0] * size[1] <= board.size:
        return ""
    return f"the pictures seem to show a board of {size[0]}x{size[1]} inner corners, larger than --board {board.cols}x{board.rows}"


def _pattern(pictures: PictureSet, board: Board) -> Board:
    """ChArUco boards with an even number of rows of squares come in two patterns.

    The one that is found more often.
    """
    if (board.rows + 1) % 2:
        return board
    both = (board, replace(board, legacy=not board.legacy))
    sample = list(_sample(pictures))
    seen = [
        sum(len(found.ids) for image in sample[:8] if (found := detect(image, option)))
        for option in both
    ]
    return both[int(np.argmax(seen))]


def _sample(pictures: PictureSet) -> Iterator[np.ndarray]:
    """Pictures of all cameras in turn, spread over the series."""
    keys = pictures.positions()
    # Neighbours in a series look alike: every fourth first, then those between.
    for key in (key for offset in (0, 2, 1, 3) for key in keys[offset::4]):
        for camera, files in pictures.files.items():
            if key in files:
                yield pictures.read(camera, key)
