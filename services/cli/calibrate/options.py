"""Options that `rhot calibrate` commands share, and what they mean together."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig, load_rig
from services.cli.calibrate.doubts import settle
from services.cli.options import ConnectOption, ProgressOption
from services.cli.progress import Progress

if TYPE_CHECKING:
    from rhot.files.calibration import LensKind
    from services.calibrator.board.board import Board
    from services.calibrator.board.board_views import LeftOut
    from services.calibrator.board.detect import Detections
    from services.calibrator.board.picture_folder import PictureSet

# The side of the squares that `rhot board` prints unless told otherwise.
_SQUARE_M = 0.025


class Kind(StrEnum):
    """What is printed on the board."""

    CHESSBOARD = "chessboard"
    CHARUCO = "charuco"


class Model(StrEnum):
    """The model of a lens."""

    AUTO = "auto"
    BROWN_CONRADY = "brown-conrady"
    FISHEYE = "fisheye"

    @property
    def kind(self) -> LensKind | None:
        """The same as calibration files have it; None: to be chosen."""
        kinds: dict[Model, LensKind] = {
            Model.BROWN_CONRADY: "brown-conrady",
            Model.FISHEYE: "fisheye",
        }
        return kinds.get(self)


CornersOption = Annotated[
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
ModelOption = Annotated[
    Model, typer.Option("--model", help="lens model; auto: by the error of held-out pictures")
]
CountOption = Annotated[
    int,
    typer.Option(
        "--count", min=5, max=200, help="with --live: how many positions of the board to collect"
    ),
]
YesOption = Annotated[
    bool,
    typer.Option("--yes", help="what looks like a slip (sizes, folders) is really so"),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print the result as JSON")]


@dataclass(frozen=True)
class BoardOptions:
    """The board that is shown in the pictures."""

    board: CornersOption = None
    square: SquareOption = None
    kind: KindOption = Kind.CHESSBOARD
    marker: MarkerOption = 0.7
    dictionary: DictionaryOption = "DICT_4X4_50"
    yes: YesOption = False

    @property
    def square_m(self) -> float:
        """Side of one square, as given or as `rhot board` prints it."""
        return self.square or _SQUARE_M

    @property
    def note(self) -> str:
        """What to say if the size of the squares was assumed, or has no unit; else empty."""
        from services.calibrator.board.board import square_note

        if self.square is not None:
            text = square_note(self.square)
            return f"note: {text}" if text else ""
        return (
            f"note: squares of {1e3 * _SQUARE_M:g} mm were assumed; measure yours and give "
            "--square: every distance scales with it"
        )

    def known_board(self) -> Board | None:
        """The board that the options describe; None if its corners are to be counted in the
        pictures.

        Raises CalibrationError for an impossible one, and for one that looks like a slip.
        """
        from services.calibrator.board.board import Board, parse_corners, square_doubt

        if self.board is None:
            if self.kind is Kind.CHARUCO:
                raise CalibrationError(
                    "a ChArUco board's size is not counted in the pictures; give its inner "
                    "corners, e.g. --board 7x5"
                )
            # Checks the square before minutes of detection.
            Board(9, 6, self.square_m)
            settle([square_doubt(self.square_m)], yes=self.yes)
            return None
        cols, rows = parse_corners(self.board)
        square_m = _SQUARE_M if self.square is None else self.square
        board = Board(cols, rows, square_m, self.kind.value, self.dictionary, self.marker)
        settle([square_doubt(square_m)], yes=self.yes)
        return board


@dataclass(frozen=True)
class PictureOptions:
    """Where pictures of the board come from, and where the result goes."""

    out: OutOption = None
    config: ConfigOption = None
    live: LiveOption = False
    connect: ConnectOption = None
    count: CountOption = 15
    model: ModelOption = Model.AUTO
    progress: ProgressOption = None
    as_json: JsonOption = False


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


def echo_json(made: msgspec.Struct) -> None:
    """Print a calibration file's content."""
    typer.echo(msgspec.json.format(msgspec.json.encode(made), indent=1).decode())


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
