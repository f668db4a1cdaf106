"""`rhot record`: all messages of a running rig in one MCAP file, until Ctrl-C or for N seconds."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import Annotated

import typer
import uvloop

from rhot import clock
from rhot.bus.bus import Bus
from rhot.errors import CaptureError
from rhot.files.config import RigConfig
from rhot.process.event_loop import cancelled_by, stop_on_signals
from rhot.process.service import rhot_version
from services.cli.options import ConnectOption, RunningRigOption
from services.cli.router_session import rig_and_endpoints, router_session
from services.cli.terminal import Terminal
from services.recorder.recorder import Recorder
from services.recorder.service import record_topic, subscribe

# What is lost if the command is killed.
_STATUS_PERIOD_S = 0.5


def record(
    config: RunningRigOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="file (*.mcap) or folder; default: [recorder] folder beside rig.toml, "
            "without --config in the current folder"
        ),
    ] = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="end after so long")] = None,
    connect: ConnectOption = None,
) -> None:
    """Record a running rig; the recording plays back with `rhot replay FILE`."""
    rig, endpoints = rig_and_endpoints(config, connect)
    path = out if out is not None and out.suffix == ".mcap" else None
    # The simulated rig's own folder is part of the installed package: nothing is written there.
    rig_folder = Path(rig.folder) if config is not None else Path()
    folder = out if out is not None and path is None else rig_folder / rig.recorder.folder
    if path is not None and path.exists():
        raise CaptureError(
            f"{path}: exists already; recordings are never overwritten, choose another --out"
        )
    recorder = Recorder(rig, folder, rhot_version(), follow_sessions=False)
    uvloop.run(_record(rig, endpoints, recorder, path, seconds))
    typer.echo(f"{recorder.messages} messages, {recorder.bytes / 1e6:.2f} MB before compression")
    if recorder.messages == 0:
        typer.echo(
            f"rhot record: nothing arrived of rig {rig.rig.name!r}; `rhot top` shows what runs",
            err=True,
        )
        raise typer.Exit(1)


async def _record(
    rig: RigConfig,
    endpoints: list[str],
    recorder: Recorder,
    path: Path | None,
    seconds: float | None,
) -> None:
    stopping = stop_on_signals()
    terminal = Terminal()
    with cancelled_by(stopping):
        async with router_session(rig.rig.name, endpoints) as bus:
            terminal.line(f"recording into {recorder.start(clock.now_ns(), path)}; Ctrl-C ends it")
            try:
                # The time the user asked for is no error.
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(seconds):
                        await _record_all(bus, rig, recorder, terminal)
            finally:
                recorder.stop()
                terminal.end()


async def _record_all(bus: Bus, rig: RigConfig, recorder: Recorder, terminal: Terminal) -> None:
    async with asyncio.TaskGroup() as tasks:
        for topic, samples in subscribe(bus, rig):
            tasks.create_task(record_topic(recorder, topic, samples))
        while True:
            await asyncio.sleep(_STATUS_PERIOD_S)
            before = recorder.path
            recorder.flush(clock.now_ns())
            if recorder.path != before:
                terminal.line(f"going on in {recorder.path}")
            terminal.status(f"{recorder.messages} messages, {recorder.bytes / 1e6:.2f} MB")
