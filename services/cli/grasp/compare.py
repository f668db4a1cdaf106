"""`rhot grasp compare REFERENCE... --out DIR`: shapes across people, a band, markers needed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from services.cli.grasp.recover import FingerOption
from services.cli.options import ProgressOption


def compare(
    references: Annotated[
        list[Path],
        typer.Argument(
            metavar="REFERENCE...",
            help="recordings of healthy fingers, or folders with them: what the band is made of",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="new folder for the results")],
    judge: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="looked at against the band; repeatable"),
    ] = None,
    accuracy: Annotated[
        float, typer.Option(min=0.1, max=90.0, help="wanted of markers, deg RMS in every joint")
    ] = 5.0,
    dot: Annotated[
        float,
        typer.Option(
            min=0.001, max=10.0, help="noise of a marker in mm, where recordings tell none"
        ),
    ] = 0.2,
    finger: FingerOption = None,
    title: Annotated[str, typer.Option(help="what stands above it")] = "Comparison of grasps",
    progress: ProgressOption = None,
) -> None:
    """Compare tip paths across people, find where one leaves their band, and count markers."""
    # Not above: matplotlib is of the extra `study`, and takes longer to import than other commands
    # take to run.
    from services.cli.grasp.comparing import Wanted, compare_all

    compare_all(references, judge or [], Wanted(out, accuracy, dot, finger, title, progress))
