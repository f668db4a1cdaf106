"""All commands of `rhot`, gathered into one typer application.

Every command is one function in the file of its name, in a room of this folder.
"""

from __future__ import annotations

import typer

from rhot.process.service import rhot_version
from services.cli.calibrate.board import board
from services.cli.calibrate.calibrate import calibrate
from services.cli.check.check import check
from services.cli.demo.demo import demo
from services.cli.deploy.deploy import deploy
from services.cli.doctor.doctor import doctor
from services.cli.evaluate.score import score
from services.cli.export.export import export
from services.cli.grasp.grasp import grasp
from services.cli.init.init import init
from services.cli.live.router import router
from services.cli.live.session import session
from services.cli.live.top import top
from services.cli.live.up import up
from services.cli.live.warm import warm
from services.cli.live.watch import watch
from services.cli.offline.simulate import simulate
from services.cli.offline.track import track
from services.cli.offline.tune import tune
from services.cli.options import menu
from services.cli.pki.pki import pki
from services.cli.plot.plot import plot
from services.cli.record.record import record
from services.cli.record.replay import replay

COMMANDS = (
    init,
    demo,
    up,
    router,
    top,
    doctor,
    watch,
    session,
    track,
    score,
    plot,
    export,
    simulate,
    record,
    replay,
    check,
    deploy,
    board,
    warm,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(rhot_version())
        raise typer.Exit


def application() -> typer.Typer:
    """The command with all its subcommands."""
    app = menu("rhot", "Real-time hand and object tracking from low-cost parts.")

    @app.callback()
    def options(
        version: bool = typer.Option(
            False, "--version", callback=_version, is_eager=True, help="print the version"
        ),
    ) -> None:
        pass

    for function in COMMANDS:
        app.command(name=function.__name__)(function)
    app.add_typer(calibrate)
    app.add_typer(tune, name="tune")
    app.add_typer(pki)
    app.add_typer(grasp)
    return app
