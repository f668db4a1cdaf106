"""`rhot router`: a Zenoh router inside Python, so that no other binary is needed.

A stock zenohd serves as well.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import Annotated

import typer
import uvloop
import zenoh

from rhot.bus.bus import router_config
from rhot.errors import BusError
from rhot.files.config import load_rig
from rhot.process import systemd
from rhot.process.lifecycle import cancelled_by, stop_on_signals

_LOOPBACK = "tcp/127.0.0.1:7447"


@contextlib.asynccontextmanager
async def running_router(listen: Sequence[str]) -> AsyncIterator[None]:
    """A router for as long as the block lasts.

    Raises BusError if an endpoint cannot be listened at.
    """
    try:
        session = await asyncio.to_thread(zenoh.open, router_config(listen))
    except zenoh.ZError as error:
        raise BusError(
            f"no router can listen at {', '.join(listen)}: {error}. "
            "Is one running there already? Choose another port with --listen tcp/127.0.0.1:PORT"
        ) from None
    try:
        yield
    finally:
        await asyncio.to_thread(session.close)


def router(
    config: Annotated[Path | None, typer.Option(help="rig.toml whose [bus] listen counts")] = None,
    listen: Annotated[
        list[str] | None, typer.Option(help="endpoint, e.g. tcp/0.0.0.0:7447 for the whole network")
    ] = None,
) -> None:
    """Run a Zenoh router until Ctrl-C (default: on loopback only)."""
    endpoints = listen or (list(load_rig(config).bus.listen) if config else [_LOOPBACK])
    uvloop.run(_route(endpoints))


async def _route(endpoints: list[str]) -> None:
    stopping = stop_on_signals()
    with cancelled_by(stopping):
        async with running_router(endpoints):
            typer.echo(f"router listening at {', '.join(endpoints)}")
            systemd.notify("READY=1")
            await asyncio.Event().wait()
