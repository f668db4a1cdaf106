"""Options that several commands share, so that each has one name and one help text everywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RunningRigOption = Annotated[
    Path | None, typer.Option("--config", help="rig.toml of the rig; default: the simulated rig's")
]
ConnectOption = Annotated[
    str | None, typer.Option("--connect", help="router endpoint, instead of rig.toml's")
]
ProgressOption = Annotated[
    bool | None, typer.Option("--progress/--no-progress", help="default: on a terminal only")
]
ResultArgument = Annotated[
    Path,
    typer.Argument(
        metavar="DIR | FILE.mcap", help="folder written by `rhot track`, or a recording"
    ),
]
VerboseOption = Annotated[
    bool, typer.Option("--verbose", "-v", help="show everything the services log")
]


def menu(name: str, about: str) -> typer.Typer:
    """A command that has subcommands; without one it lists them."""
    return typer.Typer(
        name=name,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        help=about,
    )
