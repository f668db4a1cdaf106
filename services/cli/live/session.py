"""`rhot session start|stop|show`: the start broadcast by hand."""

from __future__ import annotations

import asyncio
from enum import StrEnum
from typing import Annotated

import typer
import uvloop

from rhot.client import RigClient
from rhot.errors import BusError
from rhot.files.config import RigConfig
from rhot.messages import Session
from services.cli.options import ConnectOption, RunningRigOption
from services.cli.router_session import rig_and_endpoints, router_session

# A broadcast takes milliseconds; a machine at its limit, a second.
_HEARD_S = 3.0


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


async def _state_after(client: RigClient, action: Action) -> Session | None:
    """The session as the master has it, once it has heard the broadcast.

    The question may overtake it on a busy machine.
    """
    loop = asyncio.get_running_loop()
    deadline_s = loop.time() + _HEARD_S
    while True:
        state = await client.session()
        heard = state is None or action is Action.SHOW or state.running is (action is Action.START)
        if heard or loop.time() >= deadline_s:
            return state
        await asyncio.sleep(0.05)


async def _session(action: Action, rig: RigConfig, endpoints: list[str]) -> str:
    async with router_session(rig.rig.name, endpoints) as bus:
        client = RigClient(bus)
        if action is Action.START:
            client.start()
        elif action is Action.STOP:
            client.stop()
        state = await _state_after(client, action)
    if state is None:
        raise BusError("no master answers: is rhot-fusion running? `rhot top` shows it")
    if action is not Action.SHOW and state.running is not (action is Action.START):
        raise BusError(
            f"the session is {'running' if state.running else 'stopped'} as before: the broadcast "
            "was not heard, or somebody else has sent another; try again"
        )
    return f"session {'running' if state.running else 'stopped'} since stamp {state.start_ns} ns"
