"""`rhot plot DIR|FILE.mcap`: PNG pictures of a result, to see where a marker was lost or a joint
jumped; with --video, videos of what was tracked with all that was found drawn onto them.

What a result does not hold (no second camera, no hand) is not drawn; an empty or interrupted result
is an error.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rhot.errors import ConfigError
from services.cli.interruption import interruptible
from services.cli.options import ProgressOption, ResultArgument
from services.cli.recorded.unpacked_capture import folder_beside, is_recording


def plot(
    result: ResultArgument,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="folder for the pictures; default: DIR, or FILE's name"),
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="CAPTURE", help="capture whose truth is drawn beside")
    ] = None,
    video: Annotated[
        bool,
        typer.Option(
            "--video", help="instead of pictures, a video per camera: what was found, drawn onto it"
        ),
    ] = False,
    pictures: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CAPTURE | CAM=VIDEO",
            help="with --video: what to draw onto; default: what was tracked",
        ),
    ] = None,
    progress: ProgressOption = None,
) -> None:
    """Draw marker tracks, 3D points, joint angles, residuals, and objects with their errors."""
    # Not above: matplotlib is of the extra `study`, and takes longer to import than other commands
    # take to run.
    from services.cli.unpacked import unpacked

    folder = folder_beside(result, out)
    if pictures and not video:
        raise ConfigError("--pictures is what --video draws onto; give --video as well")
    with interruptible("rhot plot", folder), unpacked(result) as (capture, tracked):
        rig_toml = capture.rig_toml if is_recording(result) else None
        if video:
            from services.cli.plot.overlay.run import OverlayRequest, write_overlays

            request = OverlayRequest(tracked, pictures or (), rig_toml)
            for path, about in write_overlays(request, folder, progress):
                typer.echo(f"{path}: {about}")
            return
        from services.cli.plot.result import plot_result

        if truth is None and is_recording(result) and capture.truth.is_file():
            truth = capture.folder
        for path in plot_result(tracked, folder, truth, rig_toml):
            typer.echo(path)
