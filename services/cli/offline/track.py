"""`rhot track CAPTURE --out DIR`, or CAM=VIDEO pairs or a recording's FILE.mcap instead of CAPTURE:
the whole rig, offline.

As fast as it goes, and deterministic: the same input writes the same bytes. Points rest on the two
frames after them too, and hands that nobody measured are followed twice, the second time at the
size that the first found; `--as-live` does neither. A video that breaks off
is tracked up to there, and the summary says so; if no frame at all can be read, the command fails.
Of a recording the markers are taken, and points and poses are computed anew.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from services.cli.interruption import interruptible
from services.cli.offline.clocks.by_hand import OffsetOption
from services.cli.offline.seeds import SeedOption
from services.cli.options import ProgressOption
from services.cli.recorded.unpacked_capture import readable

ColorOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME",
        help="a colour to track in a video without rig.toml; default: all calibrated ones",
    ),
]
AsLiveOption = Annotated[
    bool,
    typer.Option(
        "--as-live",
        help="what a running rig tells at the time: points wait for `lag_frames` of rig.toml only, "
        "and how large a hand is shows as it moves",
    ),
]


def track(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="CAPTURE | CAM=VIDEO... | FILE.mcap",
            help="a capture folder, a video per camera, or a recording",
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--out", "-o", help="folder for markers, points, poses and objects as .jsonl"),
    ],
    config: Annotated[
        Path | None,
        typer.Option(help="rig.toml; default: the capture's own; one video needs none"),
    ] = None,
    color: ColorOption = None,
    fps: Annotated[
        list[str] | None,
        typer.Option(
            metavar="RATE | CAM=RATE",
            help="frames a second of videos whose own times are wrong, of all or of one",
        ),
    ] = None,
    offset: OffsetOption = None,
    seed: SeedOption = None,
    as_live: AsLiveOption = False,
    progress: ProgressOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="print the summary as JSON")] = False,
) -> None:
    """Track recordings offline: markers, 3D points, hand poses and objects."""
    # Not above: OpenCV and numba take longer to import than other commands take to run.
    from services.cli.offline.inputs import job_of, origin_of
    from services.cli.offline.run import run
    from services.cli.offline.track_summary import summary_text

    with interruptible("rhot track", out), readable(sources) as found:
        job = job_of(found, config, fps or (), color or ())
        # What was asked for, not what a recording was unpacked to.
        job = replace(job, origin=origin_of(sources, config, fps or ()))
        summary = run(job, out, progress, offset or (), seed or (), as_live=as_live)
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(summary), indent=1).decode())
        return
    for note in summary.notes:
        typer.echo(f"note: {note}", err=True)
    for warning in summary.warnings:
        typer.echo(f"warning: {warning}", err=True)
    typer.echo(summary_text(summary, out))
