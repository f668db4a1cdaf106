"""`rhot plot DIR|FILE.mcap`: PNG pictures of a result, to see where a marker was lost or a joint
jumped.

What a result does not hold (no second camera, no hand) is not drawn; an empty or interrupted result
is an error.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def plot(
    result: Annotated[
        Path,
        typer.Argument(
            metavar="DIR | FILE.mcap", help="folder written by `rhot track`, or a recording"
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="folder for the pictures; default: DIR, or FILE's name"),
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="CAPTURE", help="capture whose truth is drawn beside")
    ] = None,
) -> None:
    """Draw marker tracks, 3D points, joint angles, residuals, and objects with their errors."""
    # Not above: matplotlib is of the extra `study`, and takes longer to import than other commands
    # take to run.
    from services.cli.plot.result import plot_result
    from services.cli.unpacked import is_recording, unpacked

    folder = out or (result.with_suffix("") if is_recording(result) else result)
    with unpacked(result) as (capture, tracked):
        if truth is None and is_recording(result) and capture.truth.is_file():
            truth = capture.folder
        for path in plot_result(tracked, folder, truth):
            typer.echo(path)
