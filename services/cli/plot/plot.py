"""`rhot plot DIR`: PNG pictures of a result, to see where a marker was lost or a joint jumped.

What a result does not hold (no second camera, no hand) is not drawn; an empty or interrupted result
is an error.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def plot(
    result: Annotated[Path, typer.Argument(metavar="DIR", help="folder written by `rhot track`")],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="folder for the pictures; default: DIR itself"),
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="CAPTURE", help="capture whose truth is drawn beside")
    ] = None,
) -> None:
    """Draw marker tracks, 3D points, joint angles, residuals, and objects with their errors."""
    # Not above: matplotlib is of the extra `study`, and takes longer to import than other commands
    # take to run.
    from services.cli.plot.result import plot_result

    for path in plot_result(result, out or result, truth):
        typer.echo(path)
