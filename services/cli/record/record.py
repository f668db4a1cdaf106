"""`rhot record`: everything a rig says into one MCAP file, until Ctrl-C or for some seconds."""

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
from rhot.process.lifecycle import cancelled_by, stop_on_signals
from rhot.process.service import rhot_version
from services.cli.options import ConnectOption, RunningRigOption
from services.cli.router_session import reach, rig_and_endpoints
from services.cli.terminal import Teller
from services.recorder.recorder import Recorder
from services.recorder.service import record_topic, subscribe

_TELL_S = 1.0


def record(
    config: RunningRigOption = None,
    out: Annotated[
        Path | None,
        typer.Option(help="file (*.mcap) or folder; default: [recorder] folder of rig.toml"),
    ] = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="end after so long")] = None,
    connect: ConnectOption = None,
) -> None:
    """Record a running rig; the recording plays back with `rhot replay FILE`."""
    rig, endpoints = rig_and_endpoints(config, connect)
    folder = (
        out if out is not None and out.suffix != ".mcap" else Path(rig.folder) / rig.recorder.folder
    )
    path = out if out is not None and out.suffix == ".mcap" else None
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
    teller = Teller()
    with cancelled_by(stopping):
        async with reach(rig.rig.name, endpoints) as bus:
            teller.line(f"recording into {recorder.start(clock.now_ns(), path)}; Ctrl-C ends it")
            try:
                # The time the user asked for is no error.
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(seconds):
                        await _keep_all(bus, rig, recorder, teller)
            finally:
                recorder.stop()
                teller.end()


async def _keep_all(bus: Bus, rig: RigConfig, recorder: Recorder, teller: Teller) -> None:
    async with asyncio.TaskGroup() as tasks:
        for topic, samples in subscribe(bus, rig):
            tasks.create_task(record_topic(recorder, topic, samples))
        while True:
            await asyncio.sleep(_TELL_S)
            recorder.flush()
            teller.status(f"{recorder.messages} messages, {recorder.bytes / 1e6:.2f} MB")
