"""Dataclasses of options, as typer sees them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from services.cli.option_groups import grouped


@dataclass(frozen=True)
class Size:
    """A group."""

    width: Annotated[int, typer.Option("--width", "-w", min=1)] = 4
    height: Annotated[int, typer.Option(help="in lines")] = 3


@pytest.fixture
def run():
    """Runs a command with a group between options of its own; prints what it was given."""
    app = typer.Typer()

    @app.command()
    @grouped
    def draw(
        name: Annotated[str, typer.Argument()],
        fill: str = "x",
        *,
        size: Size,
        twice: bool = False,
    ) -> None:
        """Draw."""
        typer.echo(f"{name} {fill} {size.width}x{size.height} {twice}")

    return lambda *words: CliRunner().invoke(app, list(words))


def test_fields_are_options_with_their_defaults(run):
    assert run("box").stdout == "box x 4x3 False\n"
    assert run("box", "-w", "7", "--height", "2", "--twice").stdout == "box x 7x2 True\n"


def test_help_and_checks_are_those_of_the_fields(run):
    shown = run("--help").stdout
    assert "Draw." in shown
    assert shown.index("--fill") < shown.index("--width") < shown.index("--twice")
    assert "in lines" in shown
    assert run("box", "--width", "0").exit_code == 2
