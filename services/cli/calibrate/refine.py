"""`rhot calibrate refine RECORDING --config rig.toml`: the cameras' extrinsics refined from markers
that moved before them.

RECORDING is a result folder of `rhot track`, its markers.jsonl, or an MCAP of `rhot record`. Only
rig.json is written, and only if the refined extrinsics explain held-out seconds better than the old
ones do.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rhot import topics
from rhot.errors import CalibrationError
from rhot.files.calibration import load_cameras, save
from rhot.files.config import load_rig
from rhot.messages import MarkerFrame
from services.cli.calibrate import options
from services.cli.recorded.messages import messages

if TYPE_CHECKING:
    from services.calibrator.recalibrate.refine_rig import Wand


def refine(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING", help="result folder of `rhot track`, markers.jsonl, or .mcap"
        ),
    ],
    config: Annotated[Path, typer.Option("--config", help="rig.toml of the calibrated rig")],
    wand: Annotated[
        str | None,
        typer.Option(
            help="two colours and the distance of their centres in metres: blue,green=0.2"
        ),
    ] = None,
    out: options.OutOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Refine where the cameras stand from moving markers: a wand waved before all cameras, or a
    painted hand.
    """
    from services.calibrator.output.calibration_files import refined_rig_file
    from services.calibrator.output.report import refined_text
    from services.calibrator.recalibrate.marker_tracks import build_tracks
    from services.calibrator.recalibrate.refine_rig import refine_rig

    rig = load_rig(config)
    if len(rig.camera) < 2:
        raise CalibrationError(
            f"{config}: two cameras or more are needed; it has {len(rig.camera)}"
        )
    known = _parse_wand(wand) if wand is not None else None
    cameras = load_cameras(rig.calibration_dir, [camera.name for camera in rig.camera])
    recorded = messages(recording, topics.MARKERS, MarkerFrame, "markers")
    result = refine_rig(build_tracks(recorded, cameras), cameras, known)
    geometry = refined_rig_file(result, options.now_text(), str(recording), wand or "")
    path = options.out_folder(out, rig) / "rig.json"
    save(path, geometry)
    if as_json:
        options.echo_json(geometry)
        return
    typer.echo(refined_text(result))
    typer.echo(f"written: {path}")


def _parse_wand(text: str) -> Wand:
    from services.calibrator.recalibrate.refine_rig import Wand

    colors, _, length = text.partition("=")
    first, _, second = colors.partition(",")
    try:
        return Wand(first.strip(), second.strip(), float(length))
    except ValueError:
        raise CalibrationError(
            f"--wand {text!r} is not understood; write two colours and metres, "
            "e.g. --wand blue,green=0.2"
        ) from None
