"""`rhot session start|stop|show`: the start broadcast by hand."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer
import uvloop

from rhot.client import RigClient
from rhot.errors import BusError
from rhot.files.config import RigConfig
from services.cli.options import ConnectOption, RunningRigOption
from services.cli.router_session import rig_and_endpoints, router_session


class Action(StrEnum):
    """What to do with the session."""

    START = "start"
    STOP = "stop"
    SHOW = "show"


def session(
    action: Annotated[
        Action, typer.Argument(help="start or stop all trackers, or show whether they run")
    ] = Action.SHOW,
    config: RunningRigOption = None,
    connect: ConnectOption = None,
) -> None:
    """Start or stop tracking on every Pi, or show the session's state."""
    typer.echo(uvloop.run(_session(action, *rig_and_endpoints(config, connect))))


async def _session(action: Action, rig: RigConfig, endpoints: list[str]) -> str:
    async with router_session(rig.rig.name, endpoints) as bus:
        client = RigClient(bus)
        if action is Action.START:
            client.start()
        elif action is Action.STOP:
            client.stop()
        state = await client.session()
    if state is None:
        raise BusError("no master answers: is rhot-fusion running? `rhot top` shows it")
    return f"session {'running' if state.running else 'stopped'} since stamp {state.start_ns} ns"
