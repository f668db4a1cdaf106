"""`rhot calibrate stereo DIR` and `rhot calibrate world DIR`: where cameras stand, seen on a board.

stereo finds the cameras' extrinsics and their lenses, world lays the rig's frame onto the desk.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rhot.errors import CalibrationError
from rhot.files.calibration import load_cameras, load_lens, save
from rhot.files.config import RigConfig, load_rig
from services.cli.calibrate import options
from services.cli.calibrate.doubts import settle
from services.cli.option_groups import grouped
from services.cli.options import ConnectOption

if TYPE_CHECKING:
    from services.calibrator.board.picture_folder import PictureSet
    from services.calibrator.rig.result import RigResult


@grouped
def stereo(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="pictures named <camera><number>, or a folder per camera"
        ),
    ],
    shown: options.BoardOptions,
    *,
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
    source: options.PictureOptions,
) -> None:
    """Find where the cameras stand to each other, and their lenses, from pictures of a board that
    all of them see.
    """
    # Not above: OpenCV takes longer to import than other commands take to run.
    from services.calibrator.output.calibration_files import lens_vectors
    from services.calibrator.rig.calibrate import calibrate_rig

    rig = options.rig_if_named(source.config, needed=source.live)
    names = _names(cameras, rig)
    known = shown.known_board()
    target = options.out_folder(source.out, rig)
    if source.live and rig:
        from services.cli.calibrate.live_pictures import LiveCameras, collect

        running = LiveCameras(rig, names or [], folder, source.connect)
        known = collect(running, known, shown.square_m, source.count)
    pictures = _pictures(folder, names, side_by_side)
    kept = (
        {camera: load_lens(target, camera) for camera in pictures.cameras} if keep_lenses else None
    )
    known, found, blind = options.detect_all(pictures, known, shown.square_m, source.progress)
    lenses = lens_vectors(kept, found) if kept else None
    result = calibrate_rig(found, known, lenses, source.model.kind)
    result = replace(result, left_out=(*blind, *result.left_out))
    settle(result.doubts(), yes=shown.yes)
    _write(result, target, folder, as_json=source.as_json)
    if shown.note:
        typer.echo(shown.note, err=True)


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
            f"note: each picture is taken for the views of {' and '.join(found.cameras)} side by "
            "side (--side-by-side)",
            err=True,
        )
    return found


def _write(result: RigResult, target: Path, folder: Path, *, as_json: bool) -> None:
    from services.calibrator.output.calibration_files import rig_file, rig_lens_files
    from services.calibrator.output.report import rig_text

    date = options.now_text()
    lenses = rig_lens_files(result, date, str(folder))
    files = {f"{name}.lens.json": made for name, made in lenses.items()}
    geometry = rig_file(result, date, str(folder))
    for name, made in files.items():
        save(target / name, made)
    # Last: a rig.json of these lenses is never beside older ones.
    save(target / "rig.json", geometry)
    if as_json:
        options.echo_json(geometry)
        return
    typer.echo(rig_text(result))
    typer.echo("written: " + ", ".join(str(target / name) for name in [*files, "rig.json"]))


@grouped
def world(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="a picture per camera, named after it: left.png, right.png"
        ),
    ],
    config: Annotated[Path, typer.Option("--config", help="rig.toml of the calibrated rig")],
    shown: options.BoardOptions,
    live: options.LiveOption = False,
    connect: ConnectOption = None,
) -> None:
    """Put the rig's frame on the desk (z up): prints [rig.world] for rig.toml."""
    from services.calibrator.board.picture_folder import PictureSet, picture_of
    from services.calibrator.output.world_table import world_table
    from services.calibrator.rig.world_frame import find_world_frame

    rig = load_rig(config)
    names = [camera.name for camera in rig.camera]
    cameras = load_cameras(rig.calibration_dir, names)
    known = shown.known_board()
    if live:
        from services.cli.calibrate.live_pictures import LiveCameras, one_each

        one_each(LiveCameras(rig, names, folder, connect))
    files = {name: {"desk": path} for name in names if (path := picture_of(folder, name))}
    if not files:
        raise CalibrationError(
            f"{folder}: has no picture of {' or '.join(names)}; name them left.png, right.png, ... "
            "or add --live"
        )
    known, found, _ = options.detect_all(PictureSet(files), known, shown.square_m, None)
    on_desk = {name: seen["desk"] for name, seen in found.items() if seen}
    typer.echo(world_table(find_world_frame(cameras, on_desk, known), cameras[names[0]]))
    if shown.note:
        typer.echo(shown.note, err=True)
