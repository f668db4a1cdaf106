"""`rhot score CAPTURE RESULT`: errors of a result's poses against the truth of its capture.

A capture without truth.jsonl, an interrupted result, or a result of another capture is an error
that says so.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from rhot.errors import ConfigError


def score(
    capture: Annotated[
        Path,
        typer.Argument(
            metavar="CAPTURE | FILE.mcap",
            help="folder written by `rhot simulate`, with truth.jsonl, or a recording of the "
            "simulated rig",
        ),
    ],
    result: Annotated[
        Path | None,
        typer.Argument(
            metavar="RESULT",
            help="folder written by `rhot track`, or a recording; default: what the recording "
            "itself holds",
        ),
    ] = None,
    stages: Annotated[
        bool, typer.Option("--stages", help="also the errors of markers and 3D points")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of tables")] = False,
) -> None:
    """Compare tracked poses with the truth: tips, angles, orientation, dropouts, limits, delay."""
    # Not above: scipy takes longer to import than the other commands take to run.
    from services.cli.evaluate.score_result import score_result
    from services.cli.evaluate.score_table import score_text
    from services.cli.recorded.unpacked_capture import is_recording
    from services.cli.unpacked import unpacked

    if result is None and not is_recording(capture):
        raise ConfigError(
            f"{capture} is a capture; give its result as well: `rhot score {capture} RESULT`, made "
            f"by `rhot track {capture} --out RESULT`"
        )
    with unpacked(capture) as (scene, own), unpacked(result or own) as (_, tracked):
        found = score_result(scene, tracked, stages=stages)
    typer.echo(
        msgspec.json.format(msgspec.json.encode(found), indent=1).decode()
        if as_json
        else score_text(found)
    )
