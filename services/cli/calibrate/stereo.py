"""`rhot calibrate stereo DIR`: lenses and places of all cameras of a rig, from pictures of one
board that all of them saw.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from rhot.files.calibration import load_lens, save
from rhot.files.config import RigConfig
from services.cli.calibrate import options
from services.cli.calibrate.options import Kind
from services.cli.options import ConnectOption, ProgressOption

if TYPE_CHECKING:
    from services.calibrator.board.picture_folder import PictureSet
    from services.calibrator.rig.calibrate import RigResult


def stereo(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="pictures named <camera><number>, or a folder per camera"
        ),
    ],
    board: options.BoardOption = None,
    square: options.SquareOption = None,
    kind: options.KindOption = Kind.CHESSBOARD,
    marker: options.MarkerOption = 0.7,
    dictionary: options.DictionaryOption = "DICT_4X4_50",
    cameras: Annotated[
        str | None,
        typer.Option(help="names, comma-separated, the rig frame's first; default: found out"),
    ] = None,
    side_by_side: Annotated[
        bool,
        typer.Option("--side-by-side", help="each picture holds all cameras' views, left to right"),
    ] = False,
    keep_lenses: Annotated[
        bool, typer.Option("--keep-lenses", help="use the <camera>.lens.json there are")
    ] = False,
    out: options.OutOption = None,
    config: options.ConfigOption = None,
    live: options.LiveOption = False,
    connect: ConnectOption = None,
    count: options.CountOption = 15,
    progress: ProgressOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Find where the cameras stand to each other, and their lenses, from pictures of a board that
    all of them see.
    """
    from services.calibrator.output.calibration_files import lens_vectors
    from services.calibrator.rig.calibrate import calibrate_rig

    rig = options.rig_if_named(config, needed=live)
    names = _names(cameras, rig)
    known = options.board_of(board, square, kind, marker, dictionary)
    target = options.out_folder(out, rig)
    if live and rig:
        from services.cli.calibrate.live_pictures import collect

        known = collect(rig, names or [], folder, known, square or options.SQUARE_M, count, connect)
    pictures = _pictures(folder, names, side_by_side)
    kept = (
        {camera: load_lens(target, camera) for camera in pictures.cameras} if keep_lenses else None
    )
    known, found, blind = options.detect_all(pictures, known, square or options.SQUARE_M, progress)
    result = calibrate_rig(found, known, lens_vectors(kept, found) if kept else None)
    result = replace(result, left_out=(*blind, *result.left_out))
    _write(result, target, folder, as_json)
    if note := options.square_note(square):
        typer.echo(note, err=True)


def _names(cameras: str | None, rig: RigConfig | None) -> list[str] | None:
    if cameras:
        return [name.strip() for name in cameras.split(",") if name.strip()]
    return [camera.name for camera in rig.camera] if rig else None


def _pictures(folder: Path, names: list[str] | None, side_by_side: bool) -> PictureSet:
    from services.calibrator.board import picture_folder

    if side_by_side:
        return picture_folder.side_by_side(folder, names or ["left", "right"])
    found = picture_folder.find_pictures(folder, names)
    if found.side_by_side:
        typer.echo(
            f"note: each picture is taken for the views of {' and '.join(found.cameras)} side by side (--side-by-side)",
            err=True,
        )
    return found


def _write(result: RigResult, target: Path, folder: Path, as_json: bool) -> None:
    from services.calibrator.output.calibration_files import rig_lens_files, rig_file
    from services.calibrator.output.report import rig_text

    date = options.now_text()
    files = {
        f"{name}.lens.json": made for name, made in rig_lens_files(result, date, str(folder)).items()
    }
    geometry = rig_file(result, date, str(folder))
    for name, made in files.items():
        save(target / name, made)
    # Last: a rig.json of these lenses is never beside older ones.
    save(target / "rig.json", geometry)
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(geometry), indent=1).decode())
        return
    typer.echo(rig_text(result))
    typer.echo("written: " + ", ".join(str(target / name) for name in [*files, "rig.json"]))
