"""`rhot demo`: router, simulated rig, all services and the live view, on one machine, until Ctrl-C
or for N seconds.
"""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path
from typing import Annotated

import msgspec
import typer
import uvloop

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.files.config import RigConfig, load_rig
from rhot.process.lifecycle import cancelled_by, stop_on_signals
from services.cli.defaults import sim_toml
from services.cli.live.demo_metrics import LiveFigures, Summary
from services.cli.live.supervisor import Supervisor
from services.cli.live.up import children_of
from services.cli.options import VerboseOption
from services.cli.terminal import Teller

# Without a pose by then something is wrong: numba's first compilation takes most of a minute on a
# slow machine.
_FIRST_POSE_S = 120.0


def demo(
    config: Annotated[
        Path | None,
        typer.Option(help="rig.toml of a simulated rig; default: the one rhot brings along"),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.5, help="end by itself this long after the first pose, with a summary"),
    ] = None,
    viewer: Annotated[bool, typer.Option(help="show the hand in a browser")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="print the summary as JSON")] = False,
    verbose: VerboseOption = False,
) -> None:
    """Run the whole rig, simulated: a moving hand and an object, live in the browser."""
    path = config or sim_toml()
    summary = uvloop.run(_demo(load_rig(path), path, seconds, viewer, Teller(verbose=verbose)))
    if as_json:
        typer.echo(msgspec.json.encode(summary).decode())
    elif seconds is not None or summary.poses:
        typer.echo(_text(summary))
    if not summary.poses:
        typer.echo(
            "rhot demo: no pose came; `rhot demo --verbose` shows what the services say", err=True
        )
        raise typer.Exit(1)


async def _demo(
    config: RigConfig, path: Path, seconds: float | None, viewer: bool, teller: Teller
) -> Summary:
    stopping = stop_on_signals()
    supervisor, figures = Supervisor(teller.child), LiveFigures()
    endpoint = _free_endpoint(config.bus.listen[0])
    with cancelled_by(stopping):
        async with asyncio.TaskGroup() as tasks:
            keepers = [
                tasks.create_task(supervisor.keep(child))
                for child in children_of(config, path, viewer=viewer, endpoint=[endpoint])
            ]
            teller.line(
                f"rig {config.rig.name!r}, scene {config.simulator.scene!r}, router at {endpoint}; Ctrl-C ends everything"
            )
            try:
                async with (
                    open_bus(config.rig.name, [endpoint]) as bus,
                    asyncio.TaskGroup() as watchers,
                ):
                    watching = [
                        watchers.create_task(watch) for watch in _watch(bus, figures, teller)
                    ]
                    await _until_done(figures, seconds, teller)
                    for task in watching:
                        task.cancel()
            finally:
                for keeper in keepers:
                    keeper.cancel()
    teller.end()
    return figures.summary(dict(supervisor.restarts))


def _watch(bus: Bus, figures: LiveFigures, teller: Teller) -> list:
    async def poses() -> None:
        async for pose in bus.every(topics.POSE, 256):
            figures.pose(pose, clock.now_ns())

    async def truths() -> None:
        async for truth in bus.every(topics.TRUTH, 256):
            figures.truth(truth)

    async def objects() -> None:
        async for _ in bus.every(topics.OBJECT, 256):
            figures.objects += 1

    async def health() -> None:
        port = 0
        async for beat in bus.every(topics.HEALTH, 64):
            if beat.service == "viewer" and beat.values.get("port", port) != port:
                port = int(beat.values["port"])
                teller.line(f"live view: http://127.0.0.1:{port}")

    return [poses(), truths(), objects(), health()]


async def _until_done(figures: LiveFigures, seconds: float | None, teller: Teller) -> None:
    """Return when the time is over, or when no first pose came in time."""
    waited_s, last, step_s = 0.0, 0, 0.25
    while True:
        await asyncio.sleep(step_s)
        waited_s += step_s
        if not figures.poses and waited_s >= _FIRST_POSE_S and seconds is not None:
            return
        if (
            seconds is not None
            and figures.poses
            and clock.now_ns() - figures.first_ns >= seconds * 1e9
        ):
            return
        if waited_s % 1.0 == 0.0:
            error_mm = figures.tip_error_mm(last=30)
            error = "" if error_mm is None else f", tips {error_mm:.1f} mm from truth"
            teller.status(
                f"{figures.poses - last} poses/s{error}"
                if figures.poses
                else "waiting for the first pose ..."
            )
            last = figures.poses


def _free_endpoint(wanted: str) -> str:
    """The wanted loopback endpoint, or one on a free port if another router has it: a demo should
    not fail for that.
    """
    protocol, _, address = wanted.partition("/")
    host, _, port = address.rpartition(":")
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, int(port)))
        except OSError:
            probe.bind((host, 0))
        return f"{protocol}/{host}:{probe.getsockname()[1]}"


def _text(summary: Summary) -> str:
    def show(value: float | None, unit: str) -> str:
        return "not measured" if value is None else f"{value:.1f} {unit}"

    lines = [
        f"poses        {summary.poses} in {summary.seconds:.1f} s = {summary.poses_per_s:.1f} per second",
        f"latency      p50 {show(summary.latency_p50_ms, 'ms')}, p99 {show(summary.latency_p99_ms, 'ms')} (mid-exposure to pose received)",
        f"tip error    RMS {show(summary.tip_error_rms_mm, 'mm')}, median {show(summary.tip_error_median_mm, 'mm')} against the truth",
        f"object poses {summary.object_poses}",
    ]
    lines += [f"restarts     {name}: {count}" for name, count in sorted(summary.restarts.items())]
    return "\n".join(lines)
