"""`rhot doctor`: walks from rig.toml over the router to the pose, and names what is broken first.

It looks and listens for some seconds, and changes nothing. Exit code 0 if every link holds, 1 if
one is broken.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer
import uvloop

from services.cli.defaults import sim_toml
from services.cli.doctor.diagnose import diagnose
from services.cli.doctor.links import first_cause
from services.cli.doctor.observe import observe
from services.cli.doctor.text import links_text
from services.cli.options import ConnectOption, RunningRigOption


def doctor(
    config: RunningRigOption = None,
    connect: ConnectOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="print the links as JSON")] = False,
) -> None:
    """Find the first broken link between the cameras and a pose, and say what to do."""
    seen = uvloop.run(observe(Path(config or sim_toml()), connect))
    links = diagnose(seen)
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(links), indent=1).decode())
    else:
        typer.echo(links_text(links))
    if first_cause(links) is not None:
        raise typer.Exit(1)
