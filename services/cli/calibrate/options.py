"""Options that `rhot calibrate` commands share, and what they mean together."""

from __future__ import annotations

import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig, load_rig
from services.cli.progress import Progress

if TYPE_CHECKING:
    from services.calibrator.board.board import Board
    from services.calibrator.board.board_views import LeftOut
    from services.calibrator.board.detect import Detections
    from services.calibrator.board.picture_folder import PictureSet

# The side of the squares that `rhot board` prints unless told otherwise.
SQUARE_M = 0.025


class Kind(StrEnum):
    """What is printed on the board."""

    CHESSBOARD = "chessboard"
    CHARUCO = "charuco"


BoardOption = Annotated[
    str | None,
    typer.Option(
        "--board", help="inner corners, COLSxROWS, e.g. 9x6; default: counted in the pictures"
    ),
]
SquareOption = Annotated[
    float | None,
    typer.Option("--square", help="side of one square in metres, as measured; default 0.025"),
]
KindOption = Annotated[Kind, typer.Option("--kind", help="what is printed on the board")]
MarkerOption = Annotated[
    float, typer.Option("--marker", help="ChArUco: side of a marker in squares")
]
DictionaryOption = Annotated[
    str, typer.Option("--dictionary", help="ChArUco: OpenCV's name of the markers")
]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out", "-o", help="folder for the result; default: rig.toml's, or `calibration`"
    ),
]
ConfigOption = Annotated[Path | None, typer.Option("--config", help="rig.toml of the rig")]
LiveOption = Annotated[
    bool,
    typer.Option("--live", help="take the pictures now, from the running cameras, into the folder"),
]
CountOption = Annotated[
    int,
    typer.Option(
        "--count", min=5, max=200, help="with --live: how many positions of the board to collect"
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print the result as JSON")]


def board_of(
    corners: str | None, square_m: float | None, kind: Kind, marker: float, dictionary: str
) -> Board | None:
    """The board that the options describe; None if its corners are to be counted in the pictures.

    Raises CalibrationError for an impossible one.
    """
    from services.calibrator.board.board import Board, parse_corners

    if corners is None:
        if kind is Kind.CHARUCO:
            raise CalibrationError(
                "a ChArUco board's size is not counted in the pictures; give its inner corners, e.g. --board 7x5"
            )
        # Checks the square before minutes of detection.
        Board(9, 6, square_m or SQUARE_M)
        return None
    cols, rows = parse_corners(corners)
    return Board(
        cols, rows, SQUARE_M if square_m is None else square_m, kind.value, dictionary, marker
    )


def out_folder(out: Path | None, config: RigConfig | None) -> Path:
    """Where results go."""
    if out is not None:
        return out
    return config.calibration_dir if config else Path("calibration")


def rig_if_named(config: Path | None, *, needed: bool = False) -> RigConfig | None:
    """The rig of --config.

    Raises CalibrationError if it is needed and not given.
    """
    if config is None and needed:
        raise CalibrationError(
            "--live asks the rig's cameras; say which rig with --config rig.toml"
        )
    return load_rig(config) if config else None


def now_text() -> str:
    """The date that goes into calibration files."""
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")


def square_note(square_m: float | None) -> str:
    """What to say if the size of the squares was assumed."""
    if square_m is not None:
        return ""
    return f"note: squares of {1e3 * SQUARE_M:g} mm were assumed; measure yours and give --square: every distance scales with it"


def detect_all(
    pictures: PictureSet, board: Board | None, square_m: float, progress: bool | None
) -> tuple[Board, Detections, list[LeftOut]]:
    """The board (counted if not given) and where each picture shows it, with a progress line."""
    import cv2

    from services.calibrator.board.find_boards import (
        determine_board,
        find_boards,
        larger_board_note,
    )

    # More threads than one gain nothing here, and change the order of sums.
    cv2.setNumThreads(1)
    known = determine_board(pictures, board, square_m)
    if board is not None and (note := larger_board_note(pictures, board)):
        typer.echo(f"note: {note}", err=True)
    shown = Progress(
        "rhot calibrate: looking for the board,",
        sum(len(files) for files in pictures.files.values()),
        progress,
    )
    try:
        found, blind = find_boards(pictures, known, shown.advance)
    finally:
        shown.end()
    return known, found, blind
