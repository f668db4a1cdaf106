"""`rhot calibrate lens NAME DIR`: one camera's lens from a folder of board pictures, or live from
the running camera.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from services.cli.calibrate import options
from services.cli.calibrate.options import Kind
from services.cli.options import ConnectOption, ProgressOption


def lens(
    name: Annotated[str, typer.Argument(help="the camera's name in rig.toml")],
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="pictures of the board; with --live they are put there"),
    ],
    board: options.BoardOption = None,
    square: options.SquareOption = None,
    kind: options.KindOption = Kind.CHESSBOARD,
    marker: options.MarkerOption = 0.7,
    dictionary: options.DictionaryOption = "DICT_4X4_50",
    out: options.OutOption = None,
    config: options.ConfigOption = None,
    live: options.LiveOption = False,
    connect: ConnectOption = None,
    count: options.CountOption = 15,
    progress: ProgressOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Find a camera's focal length, centre and distortion from pictures of a board."""
    # Not above: OpenCV takes longer to import than other commands take to run.
    from rhot.files.calibration import save
    from services.calibrator.board.picture_folder import one_camera
    from services.calibrator.lens.calibrate import calibrate_camera
    from services.calibrator.output.calibration_files import lens_file
    from services.calibrator.output.report import lens_text

    rig = options.rig_if_named(config, needed=live)
    known = options.board_of(board, square, kind, marker, dictionary)
    if live and rig:
        from services.cli.calibrate.live_pictures import collect

        known = collect(rig, [name], folder, known, square or options.SQUARE_M, count, connect)
    pictures = one_camera(folder, name)
    known, found, blind = options.detect_all(pictures, known, square or options.SQUARE_M, progress)
    result = calibrate_camera(name, found[name], known)
    result = replace(result, left_out=(*blind, *result.left_out))
    made = lens_file(result, known, options.now_text(), str(folder))
    path = options.out_folder(out, rig) / f"{name}.lens.json"
    save(path, made)
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(made), indent=1).decode())
        return
    typer.echo(lens_text(result, known))
    if note := options.square_note(square):
        typer.echo(note, err=True)
    typer.echo(f"written: {path}")
