"""`rhot top`: what is wrong, and the state, rates, losses and ages of every service, live.

On a terminal it fills the second screen and leaves it at the end; elsewhere it prints tables. Rates
are compared with the topics table. The parts of a pose's age add up, from mid-exposure to the
published pose.
"""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Annotated

import msgspec
import typer
import uvloop

from rhot import clock
from rhot.files.config import RigConfig
from rhot.process.event_loop import cancelled_by, stop_on_signals
from rhot.watch.follow import watching_objects
from rhot.watch.rig_monitor import RigMonitor
from rhot.watch.rig_state import RigState
from services.cli.live.alternate_screen import alternate_screen, size
from services.cli.live.top_screen import screen
from services.cli.options import ConnectOption, RunningRigOption
from services.cli.router_session import rig_and_endpoints, router_session

# A beat comes once a second: within two, every running service has sent one.
_LISTEN_S = 2.2
# Of a table that goes to a file or a pipe.
_WIDTH = 120


def top(
    config: RunningRigOption = None,
    connect: ConnectOption = None,
    once: Annotated[
        bool,
        typer.Option(help="print one table and end; exit code 1 if something is missing or slow"),
    ] = False,
    seconds: Annotated[float | None, typer.Option(min=1.0, help="end after so long")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON object a second")] = False,
) -> None:
    """Show what is wrong, every service, its rates and latencies, live."""
    rig, endpoints = rig_and_endpoints(config, connect)
    state = uvloop.run(_top(rig, endpoints, once, seconds, as_json))
    if once and (state is None or not state.healthy):
        raise typer.Exit(1)


async def _top(
    rig: RigConfig, endpoints: list[str], once: bool, seconds: float | None, as_json: bool
) -> RigState | None:
    stopping = stop_on_signals()
    monitor, state = RigMonitor(rig, clock.now_ns()), None
    with cancelled_by(stopping):
        async with router_session(rig.rig.name, endpoints) as bus, watching_objects(bus, monitor):
            left_s = _LISTEN_S if once else seconds
            await asyncio.sleep(_LISTEN_S)
            with _display(once, as_json) as show:
                while True:
                    state = monitor.state(clock.now_ns())
                    show(state)
                    left_s = None if left_s is None else left_s - (_LISTEN_S if once else 1.0)
                    if left_s is not None and left_s <= 0.0:
                        break
                    await asyncio.sleep(1.0)
    return state


@contextlib.contextmanager
def _display(once: bool, as_json: bool) -> Iterator[Callable[[RigState], None]]:
    """How a state is shown: as JSON, as a table, or on the terminal's second screen."""
    if as_json:
        yield lambda state: typer.echo(msgspec.json.encode(state).decode())
    elif once or not sys.stdout.isatty():
        yield lambda state: typer.echo("\n".join(screen(state, _WIDTH, None)))
    else:
        with alternate_screen() as show:
            yield lambda state: show(screen(state, *size()))
