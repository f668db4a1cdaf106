"""`rhot export DIR|FILE.mcap`: a recording as flat tables, for spreadsheets, pandas or R."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rhot.errors import CaptureError, ConfigError
from services.cli.options import ProgressOption


def export(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="DIR | FILE.mcap", help="folder written by `rhot track`, or a recording"
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="folder for the tables; default: DIR, or FILE's name"),
    ] = None,
    csv: Annotated[bool, typer.Option("--csv", help="as .csv (the default)")] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="as .parquet")] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="TABLE", help="only this table; may be given again; default: all"),
    ] = None,
    progress: ProgressOption = None,
) -> None:
    """Write markers, points, poses, angles, objects and contacts as tables: s, mm, deg, px."""
    # Not above: other commands should not wait for what these import.
    from services.cli.export.run import export as export_tables
    from services.cli.export.tables import TABLES

    names = [table.name for table in TABLES]
    for name in only or ():
        if name not in names:
            raise ConfigError(f"--only {name}: there is no such table; valid: {', '.join(names)}")
    if not recording.exists():
        raise CaptureError(f"{recording}: no such folder or file")
    formats = [name for name, wanted in (("csv", csv), ("parquet", parquet)) if wanted] or ["csv"]
    folder = out or (recording if recording.is_dir() else recording.with_suffix(""))
    for path, rows in export_tables(recording, folder, formats, only or (), progress).items():
        typer.echo(f"{path}: {rows} rows")
