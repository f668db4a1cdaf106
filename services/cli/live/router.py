"""`rhot router`: a Zenoh router inside Python, so that no other binary is needed.

A stock zenohd serves as well.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import typer
import uvloop
import zenoh

from rhot.bus.security.credentials import plain, with_certificates
from rhot.bus.stalled_links import give_up_stalled_connections
from rhot.bus.zenoh_config import router_config, router_settings
from rhot.errors import BusError, RhotError
from rhot.files.config import RigConfig
from rhot.process import systemd
from rhot.process.event_loop import cancelled_by, stop_on_signals
from rhot.process.lifecycle import EXIT_USER, fed_watchdog
from rhot.process.restart_hold import hold_back
from rhot.process.threads.allocator import share_one_heap
from services.cli.live.routed_rigs import (
    check_certificates,
    check_ports,
    listening_for,
    routed_rigs,
)
from services.cli.options import menu

_LOOPBACK = "tcp/127.0.0.1:7447"


@contextlib.asynccontextmanager
async def running_router(listen: Sequence[str], *rigs: RigConfig) -> AsyncIterator[None]:
    """A router for as long as the block lasts, with the rules of the rigs' rig.toml.

    Raises BusError if an endpoint cannot be listened at, or this host's certificate is no good.
    """
    check_certificates(listen)
    try:
        session = await asyncio.to_thread(zenoh.open, router_config(listen, *rigs))
    except zenoh.ZError as error:
        check_ports(listen)
        where = ", ".join(map(plain, listen))
        reason = str(error).split(" at /")[0]
        raise BusError(f"no router can listen at {where}: {reason}") from None
    give_up_stalled_connections()
    try:
        yield
    finally:
        await asyncio.to_thread(session.close)


def router(
    config: Annotated[
        list[Path] | None,
        typer.Option(
            help="rig.toml: where to listen, and who may do what; several, or a folder of them: "
            "one router for all these rigs"
        ),
    ] = None,
    listen: Annotated[
        list[str] | None,
        typer.Option(help="endpoint, e.g. tls/0.0.0.0:7448, instead of rig.toml's"),
    ] = None,
    show: Annotated[
        bool, typer.Option("--print", help="print the configuration, for a zenohd, and end")
    ] = False,
) -> None:
    """Run a Zenoh router until Ctrl-C (default: on loopback only)."""
    files = config or []
    if show:
        endpoints, rigs = _settings(files, listen, to_run=False)
        typer.echo(router_json5(endpoints, *rigs))
        return
    share_one_heap()
    started_s = time.monotonic()
    try:
        uvloop.run(_route(*_settings(files, listen)))
    except RhotError as error:
        typer.echo(f"rhot: error: {error}", err=True)
        hold_back(error, time.monotonic() - started_s, files)
        raise typer.Exit(EXIT_USER) from None


def application() -> typer.Typer:
    """`rhot` with this command alone."""
    app = menu("rhot", "Real-time hand and object tracking from low-cost parts.")

    @app.callback()
    def _keep_its_name() -> None:
        # typer leaves the name of a single command out.
        pass

    app.command()(router)
    return app


def _settings(
    paths: Sequence[Path], listen: Sequence[str] | None, *, to_run: bool = True
) -> tuple[list[str], list[RigConfig]]:
    """Endpoints with their certificates, and the rigs whose roles the router keeps to."""

    def tell(text: str) -> None:
        typer.echo(f"rhot: error: {text}", err=True)

    # Where it listens elsewhere, it does not matter whether it could where the rigs say.
    rigs = routed_rigs(paths, tell, to_run=to_run and not listen)
    if not rigs:
        return list(listen or [_LOOPBACK]), rigs
    if listen:
        return with_certificates(listen, rigs[0].certificates_dir, "listen"), rigs
    return listening_for(rigs), rigs


def router_json5(listen: Sequence[str], *rigs: RigConfig) -> str:
    """The router's configuration as a stock zenohd reads it."""
    settings = msgspec.json.encode(router_settings(listen, *rigs))
    about = "// Written by `rhot router --print`: change rig.toml and print it again."
    return f"{about}\n{msgspec.json.format(settings, indent=2).decode()}"


async def _route(endpoints: list[str], rigs: Sequence[RigConfig]) -> None:
    stopping = stop_on_signals()
    with cancelled_by(stopping):
        async with fed_watchdog(), running_router(endpoints, *rigs):
            of = f" for {', '.join(config.rig.name for config in rigs)}" if len(rigs) > 1 else ""
            typer.echo(f"router{of} listening at {', '.join(map(plain, endpoints))}")
            systemd.notify("READY=1")
            await asyncio.Event().wait()
