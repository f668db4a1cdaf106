"""`rhot board`: a calibration board as a PDF of exact size."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from services.cli.calibrate.options import DictionaryOption, Kind, KindOption, MarkerOption


def board(
    out: Annotated[Path, typer.Option("--out", "-o", help="the PDF to write")] = Path("board.pdf"),
    kind: KindOption = Kind.CHESSBOARD,
    cols: Annotated[int, typer.Option(help="inner corners in a row: one less than squares")] = 9,
    rows: Annotated[int, typer.Option(help="inner corners in a column")] = 6,
    square_mm: Annotated[float, typer.Option("--square-mm", help="side of one square")] = 25.0,
    marker: MarkerOption = 0.7,
    dictionary: DictionaryOption = "DICT_4X4_50",
    paper: Annotated[str, typer.Option(help="a4, letter, a3, ... a0")] = "a4",
) -> None:
    """Write a calibration board to print: without scaling, on flat and stiff material."""
    # Not above: OpenCV takes longer to import than other commands take to run.
    from services.calibrator.board.board import Board
    from services.calibrator.board.board_pdf import board_pdf

    made = Board(cols, rows, 1e-3 * square_mm, kind.value, dictionary, marker)
    document = board_pdf(made, paper.lower())
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(document)
    charuco = f" --kind charuco --marker {marker:g} --dictionary {dictionary}"
    shown = f"--board {cols}x{rows} --square {made.square_m:g}"
    typer.echo(
        f"{out}: {made.name}. Print it at 100 %, check the 100 mm line with a ruler, glue it to "
        "something flat and stiff, then e.g.\n"
        f"  rhot calibrate stereo PICTURES {shown}{charuco if kind is Kind.CHARUCO else ''}"
    )
