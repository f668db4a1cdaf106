"""The boards in a folder of pictures: which board it is, and where each picture shows it.

Pure but for reading the files. Both calibrations begin here. Pictures without a whole board are
listed with that reason. A folder without any board is refused by the calibration itself, or here if
the size of the board had to be counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from rhot.errors import CalibrationError
from services.calibrator.board.board import Board
from services.calibrator.board.board_size import find_board_size
from services.calibrator.board.board_views import LeftOut
from services.calibrator.board.detect import Detection, Detections, detect
from services.calibrator.board.picture_folder import PictureSet

# Called with the number of pictures searched since the last call.
Progress = Callable[[int], None]
# Pictures in which the board is counted, to compare its size with the given one.
_COUNTED = 4
# Pictures in which both patterns of a ChArUco board are tried.
_TRIED = 8
# Pictures searched thoroughly where the quick detectors found nothing in any.
_THOROUGH = 3


def find_boards(
    pictures: PictureSet, board: Board, progress: Progress = lambda _: None
) -> tuple[Detections, list[LeftOut]]:
    """The board in every picture, and the pictures that do not show it as a whole.

    Raises CalibrationError if a picture cannot be read.
    """
    results: dict[tuple[str, str], Detection | None] = {}
    for camera, files in pictures.files.items():
        for key in files:
            results[camera, key] = detect(pictures.read(camera, key), board, quick=True)
            progress(1)
    missed = [place for place, detection in results.items() if detection is None]
    # Where the quick detectors find nothing at all, it is the wrong board: a few pictures searched
    # thoroughly tell as much.
    for camera, key in missed if len(missed) < len(results) else missed[:_THOROUGH]:
        results[camera, key] = detect(pictures.read(camera, key), board)
    detections: Detections = {camera: {} for camera in pictures.files}
    left_out = []
    for (camera, key), detection in results.items():
        if detection is None:
            left_out.append(LeftOut(camera, key, "does not show the whole board"))
        else:
            detections[camera][key] = detection
    return detections, left_out


def determine_board(pictures: PictureSet, board: Board | None, square_m: float) -> Board:
    """The given board with the ChArUco pattern these pictures show, or the chessboard in them.

    Raises CalibrationError if no board is given, and no picture shows a chessboard.
    """
    if board is not None:
        return _with_pattern(pictures, board) if board.kind == "charuco" else board
    size = find_board_size(_sample(pictures))
    if size is None:
        raise CalibrationError(
            "no picture shows a chessboard as a whole, so its size cannot be counted; give it with "
            "--board COLSxROWS (inner corners), or --kind charuco for a board with markers. It "
            "must be in focus, evenly lit, and completely in the picture with a white margin"
        )
    return Board(*size, square_m)


def larger_board_note(pictures: PictureSet, board: Board) -> str:
    """A note if the pictures show a larger chessboard than the given one; empty if not.

    A part of a board calibrates, but every picture may show another part, and the outer corners are
    lost.
    """
    if board.kind == "charuco":
        return ""
    size = find_board_size(islice(_sample(pictures), _COUNTED))
    if size is None or size[0] * size[1] <= board.size:
        return ""
    return (
        f"the pictures seem to show a board of {size[0]}x{size[1]} inner corners, larger than "
        f"--board {board.cols}x{board.rows}; give --board {size[0]}x{size[1]} if that is the board"
    )


def _with_pattern(pictures: PictureSet, board: Board) -> Board:
    """The ChArUco board with that pattern of which more corners are found.

    Boards with an even number of rows of squares come in two patterns.
    """
    if (board.rows + 1) % 2:
        return board
    patterns = (board, replace(board, legacy=not board.legacy))
    sample = list(islice(_sample(pictures), _TRIED))
    corners = [
        sum(len(found.ids) for image in sample if (found := detect(image, pattern)))
        for pattern in patterns
    ]
    return patterns[int(np.argmax(corners))]


def _sample(pictures: PictureSet) -> Iterator[np.ndarray]:
    """Pictures of all cameras in turn, spread over the series."""
    keys = pictures.positions()
    # Neighbours in a series look alike: every fourth first, then those between.
    for key in (key for offset in (0, 2, 1, 3) for key in keys[offset::4]):
        for camera, files in pictures.files.items():
            if key in files:
                yield pictures.read(camera, key)
