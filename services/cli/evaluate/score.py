"""`rhot score CAPTURE RESULT`: errors of a result's poses against the truth of its capture.

A capture without truth.jsonl, an interrupted result, or a result of another capture is an error
that says so.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from rhot.files.capture import Capture


def score(
    capture: Annotated[
        Path, typer.Argument(help="folder written by `rhot simulate`, with truth.jsonl")
    ],
    result: Annotated[Path, typer.Argument(help="folder written by `rhot track`")],
    stages: Annotated[
        bool, typer.Option("--stages", help="also the errors of markers and 3D points")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of tables")] = False,
) -> None:
    """Compare tracked poses with the truth: tips, angles, orientation, dropouts, limits, delay."""
    # Not above: scipy takes longer to import than the other commands take to run.
    from services.cli.evaluate.score_result import score_result
    from services.cli.evaluate.score_table import score_text

    found = score_result(Capture(capture), result, stages=stages)
    typer.echo(
        msgspec.json.format(msgspec.json.encode(found), indent=1).decode()
        if as_json
        else score_text(found)
    )
