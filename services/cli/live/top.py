"""`rhot top`: the state, rates, losses and latencies of every service, live.

Rates are compared with the topics table. Latencies are of each hop, and from glass to pose: from
mid-exposure to the published pose.
"""

from __future__ import annotations

import asyncio
import sys
from typing import Annotated

import msgspec
import typer
import uvloop

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.files.config import RigConfig
from rhot.process.lifecycle import cancelled_by, stop_on_signals
from services.cli.live.top_table import ServiceMonitor, TopTable, expected_services
from services.cli.live.top_text import table_text
from services.cli.options import ConnectOption, RunningRigOption
from services.cli.router_session import rig_and_endpoints, router_session

# A beat comes once a second: within two, every running service has sent one.
_LISTEN_S = 2.2


def top(
    config: RunningRigOption = None,
    connect: ConnectOption = None,
    once: Annotated[
        bool,
        typer.Option(help="print one table and end; exit code 1 if something is missing or slow"),
    ] = False,
    seconds: Annotated[float | None, typer.Option(min=1.0, help="end after so long")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON object a table")] = False,
) -> None:
    """Show every service, its rates and latencies, live."""
    rig, endpoints = rig_and_endpoints(config, connect)
    table = uvloop.run(_top(rig, endpoints, once, seconds, as_json))
    if once and (table is None or not table.healthy):
        raise typer.Exit(1)


async def _top(
    rig: RigConfig, endpoints: list[str], once: bool, seconds: float | None, as_json: bool
) -> TopTable | None:
    stopping = stop_on_signals()
    monitor, table = ServiceMonitor(rig.rig.name, expected_services(rig)), None
    with cancelled_by(stopping):
        async with router_session(rig.rig.name, endpoints) as bus, asyncio.TaskGroup() as tasks:
            listeners = [
                tasks.create_task(_beats(bus, monitor)),
                tasks.create_task(_tokens(bus, monitor)),
            ]
            left_s = _LISTEN_S if once else seconds
            await asyncio.sleep(_LISTEN_S)
            while True:
                table = monitor.table(clock.now_ns())
                _show(table, as_json)
                left_s = None if left_s is None else left_s - (_LISTEN_S if once else 1.0)
                if left_s is not None and left_s <= 0.0:
                    break
                await asyncio.sleep(1.0)
            for task in listeners:
                task.cancel()
    return table


async def _beats(bus: Bus, monitor: ServiceMonitor) -> None:
    async for health in bus.every(topics.HEALTH, 1024):
        monitor.beat(health, clock.now_ns())


async def _tokens(bus: Bus, monitor: ServiceMonitor) -> None:
    async for change in bus.watch_alive():
        monitor.token(change.service, change.instance, change.alive)


def _show(table: TopTable, as_json: bool) -> None:
    if as_json:
        typer.echo(msgspec.json.encode(table).decode())
        return
    if sys.stdout.isatty():
        typer.echo("\033[H\033[2J", nl=False)
    typer.echo(table_text(table))
