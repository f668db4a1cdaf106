"""`rhot grasp report DIR`: figures, tables and one HTML file to hand over."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from services.cli.options import ProgressOption


def report(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="what `rhot grasp recover --out DIR` wrote")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="folder for the report; default: DIR/report")
    ] = None,
    title: Annotated[str, typer.Option(help="what stands above it")] = "Grasp study",
    progress: ProgressOption = None,
) -> None:
    """Draw and tabulate what was recovered: Markdown, PNG, CSV, JSON and one HTML file."""
    # Not above: matplotlib is of the extra `study`, and takes longer to import than other commands
    # take to run.
    from collections.abc import Callable

    from rhot.errors import writing
    from services.cli.grasp.inputs import made_by
    from services.cli.progress import Progress
    from studies.grasp.report.write import write_report

    line = Progress("drawing", 0, progress, unit="figures")

    def begun(figures: int) -> Callable[[], None]:
        line.total = figures
        return line.advance

    about = f"{made_by()} of {folder.resolve().name}."
    where = out or folder / "report"
    with writing(where):
        files = write_report(folder, where, title, about, begun)
    line.end()
    typer.echo(f"{files[0]}: {len(files)} files")
