"""`rhot export DIR|FILE.mcap`: a recording as flat tables, or as motion for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rhot.errors import CaptureError, ConfigError
from services.cli.export.motion_options import (
    BvhOption,
    GltfOption,
    MotOption,
    TrcOption,
    UpOption,
)
from services.cli.interruption import interruptible
from services.cli.options import ProgressOption, ResultArgument
from services.cli.recorded.unpacked_capture import folder_beside


def export(
    recording: ResultArgument,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="folder for the tables; default: DIR, or FILE's name"),
    ] = None,
    csv: Annotated[bool, typer.Option("--csv", help="as .csv (the default)")] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="as .parquet")] = False,
    bvh: BvhOption = False,
    trc: TrcOption = False,
    mot: MotOption = False,
    gltf: GltfOption = False,
    up: UpOption = "-y",
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="TABLE", help="only this table; may be given again; default: all"),
    ] = None,
    progress: ProgressOption = None,
) -> None:
    """Write markers, points, poses, angles, objects and contacts as tables: s, mm, deg, px.

    Or hands' motion, in the formats of other programs.
    """
    # Not above: other commands should not wait for what these import.
    from rhot.geometry.up_axes import UPS
    from services.cli.export.motion.run import FORMATS, export_motion
    from services.cli.export.run import export as export_tables
    from services.cli.export.tables import TABLES

    names = [table.name for table in TABLES]
    for name in only or ():
        if name not in names:
            raise ConfigError(f"--only {name}: there is no such table; valid: {', '.join(names)}")
    if not recording.exists():
        raise CaptureError(f"{recording}: no such folder or file")
    if up not in UPS:
        raise ConfigError(f"--up {up}: valid: {', '.join(UPS)}")
    folder = folder_beside(recording, out)
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--out {folder}: is a file; give a folder, new or there already")
    motions = [name for name, wanted in zip(FORMATS, (bvh, trc, mot, gltf), strict=True) if wanted]
    formats = [name for name, wanted in (("csv", csv), ("parquet", parquet)) if wanted]
    with interruptible("rhot export", folder):
        if motions:
            for path, clip in export_motion(recording, folder, motions, up).items():
                bridged = f"; {clip.gaps} gaps bridged" if clip.gaps else ""
                typer.echo(f"{path}: {len(clip.wrist_m)} frames at {clip.rate_hz:g} Hz{bridged}")
        if motions and not formats:
            return
        tables = export_tables(recording, folder, formats or ["csv"], only or (), progress)
    for path, rows in tables.items():
        typer.echo(f"{path}: {rows} rows")
