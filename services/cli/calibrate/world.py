"""`rhot calibrate world DIR --config rig.toml`: the rig's frame laid onto the desk, from one
picture per camera of a board lying there.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rhot.errors import CalibrationError
from rhot.files.calibration import load_cameras
from services.cli.calibrate import options
from services.cli.calibrate.options import Kind
from services.cli.options import ConnectOption


def world(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="a picture per camera, named after it: left.png, right.png"
        ),
    ],
    config: Annotated[Path, typer.Option("--config", help="rig.toml of the calibrated rig")],
    board: options.BoardOption = None,
    square: options.SquareOption = None,
    kind: options.KindOption = Kind.CHESSBOARD,
    marker: options.MarkerOption = 0.7,
    dictionary: options.DictionaryOption = "DICT_4X4_50",
    live: options.LiveOption = False,
    connect: ConnectOption = None,
) -> None:
    """Put the rig's frame on the desk (z up): prints [rig.world] for rig.toml."""
    from services.calibrator.board.picture_folder import PictureSet, picture_of
    from services.calibrator.output.world_table import world_table
    from services.calibrator.rig.world_frame import find_world_frame

    rig = options.rig_if_named(config)
    if rig is None:
        raise CalibrationError("the rig is needed: --config rig.toml")
    names = [camera.name for camera in rig.camera]
    cameras = load_cameras(rig.calibration_dir, names)
    known = options.board_of(board, square, kind, marker, dictionary)
    if live:
        from services.cli.calibrate.live_pictures import one_each

        one_each(rig, names, folder, connect)
    files = {name: {"desk": path} for name in names if (path := picture_of(folder, name))}
    if not files:
        raise CalibrationError(
            f"{folder}: has no picture of {' or '.join(names)}; name them left.png, right.png, ... or add --live"
        )
    known, found, _ = options.detect_all(PictureSet(files), known, square or options.SQUARE_M, None)
    on_desk = {name: seen["desk"] for name, seen in found.items() if seen}
    typer.echo(world_table(find_world_frame(cameras, on_desk, known), cameras[names[0]]))
    if note := options.square_note(square):
        typer.echo(note, err=True)
