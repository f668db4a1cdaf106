"""`rhot calibrate lens NAME DIR`: one camera's lens from a folder of board pictures, or live from
the running camera.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from services.cli.calibrate import options
from services.cli.calibrate.doubts import settle
from services.cli.option_groups import grouped


@grouped
def lens(
    name: Annotated[str, typer.Argument(help="the camera's name in rig.toml")],
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="pictures of the board; with --live they are put there"),
    ],
    shown: options.BoardOptions,
    source: options.PictureOptions,
) -> None:
    """Find a camera's focal length, centre and distortion from pictures of a board."""
    # Not above: OpenCV takes longer to import than other commands take to run.
    from rhot.files.calibration import save
    from services.calibrator.board.board_views import size_doubt
    from services.calibrator.board.picture_folder import mixed_cameras, one_camera
    from services.calibrator.lens.calibrate import calibrate_lens
    from services.calibrator.output.calibration_files import lens_file
    from services.calibrator.output.report import lens_text

    rig = options.rig_if_named(source.config, needed=source.live)
    known = shown.known_board()
    if source.live and rig:
        from services.cli.calibrate.live_pictures import LiveCameras, collect

        cameras = LiveCameras(rig, [name], folder, source.connect)
        known = collect(cameras, known, shown.square_m, source.count)
    settle([mixed_cameras(folder, name)], yes=shown.yes)
    pictures = one_camera(folder, name)
    known, found, blind = options.detect_all(pictures, known, shown.square_m, source.progress)
    settle([size_doubt(name, found[name])], yes=shown.yes)
    result = calibrate_lens(name, found[name], known, source.model.kind)
    result = replace(result, left_out=(*blind, *result.left_out))
    made = lens_file(result, known, options.now_text(), str(folder))
    path = options.out_folder(source.out, rig) / f"{name}.lens.json"
    save(path, made)
    if source.as_json:
        options.echo_json(made)
        return
    typer.echo(lens_text(result, known))
    if shown.note:
        typer.echo(shown.note, err=True)
    typer.echo(f"written: {path}")
