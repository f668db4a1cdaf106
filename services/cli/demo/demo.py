"""`rhot demo`: the whole rig, simulated, on one machine, until Ctrl-C or for N seconds.

Router, simulator, trackers, fusion with the solver, object tracker and viewer are processes of
their own, as in `rhot up`. They run on a copy of the configuration that rhot ships.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer
import uvloop

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import ConfigError
from rhot.files.config import RigConfig, load_rig
from rhot.process.event_loop import cancelled_by, stop_on_signals
from services.cli.demo.evidence import Evidence
from services.cli.demo.metrics import DemoMetrics
from services.cli.demo.narrator import Narrator
from services.cli.demo.summary import Summary, summary_text
from services.cli.demo.tour import SCENE as TOUR_SCENE
from services.cli.demo.tour import STEPS, Tour, touring
from services.cli.live.supervisor import Supervisor
from services.cli.live.up import children_of
from services.cli.live.working_copy import has_rig, working_copy
from services.cli.option_groups import grouped
from services.cli.options import VerboseOption
from services.cli.terminal import Terminal

# Without a pose by then something is wrong. numba's first compilation takes minutes of a core's
# time, and two cores that had other work did not finish within four.
_FIRST_POSE_S = 480.0
# A hand that takes a cup shows hand, object and touch.
SCENE = "grab"
_POLL_S = 0.25


@dataclass(frozen=True)
class Shown:
    """For how long, where, and whether it is explained."""

    tour: Annotated[
        bool,
        typer.Option(
            "--tour",
            help="explain what is seen, again and again: the hand, lost paint, a bumped camera, a "
            "grasp; in the terminal and in the browser",
        ),
    ] = False
    seconds: Annotated[
        float | None,
        typer.Option(min=0.5, help="end by itself this long after the first pose, with a summary"),
    ] = None
    viewer: Annotated[bool, typer.Option(help="show the hand in a browser")] = True


@grouped
def demo(
    config: Annotated[
        Path | None,
        typer.Option(
            help="rig.toml of a simulated rig, run where it is; default: a copy of rhot's own"
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            help="keep the copy of rhot's own rig here, and continue with it the next time; "
            "default: a temporary folder, removed at the end"
        ),
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(
            help="what the simulated hand does: pinch, fist, wave, piano, grasp; `rhot simulate "
            "--list` names all. Default: grasp, where it takes a cup"
        ),
    ] = None,
    *,
    shown: Shown,
    as_json: Annotated[bool, typer.Option("--json", help="print the summary as JSON")] = False,
    verbose: VerboseOption = False,
) -> None:
    """Run the whole rig, simulated: a hand that takes a cup, live in the browser."""
    with _rig(config, folder, scene, tour=shown.tour) as path:
        terminal = Terminal(verbose=verbose)
        if config is None:
            kept = "" if folder else "; removed at the end, --folder DIR keeps it"
            terminal.line(f"working folder {path.parent}{kept}")
        summary = uvloop.run(_demo(path, shown, terminal))
    if as_json:
        typer.echo(msgspec.json.encode(summary).decode())
    elif shown.seconds is not None or summary.poses:
        typer.echo(summary_text(summary))
    if not summary.poses:
        typer.echo(
            "rhot demo: no pose came; `rhot demo --verbose` shows what the services log", err=True
        )
        raise typer.Exit(1)


def _rig(
    config: Path | None, folder: Path | None, scene: str | None, *, tour: bool
) -> contextlib.AbstractContextManager[Path]:
    """The rig.toml to run; raises ConfigError where options do not go together."""
    if tour and (config or scene):
        raise ConfigError(
            "--tour shows rhot's own rig and scenes of its own: leave --config and --scene out"
        )
    if config is None:
        return working_copy(folder, _scene(TOUR_SCENE if tour and not folder else scene, folder))
    if folder is not None:
        raise ConfigError(
            "--folder is for rhot's own rig, --config for another one, which runs where it is: "
            "give one of them"
        )
    if scene is not None:
        raise ConfigError(
            f"--scene is for rhot's own rig; set `scene` under [simulator] in {config}"
        )
    return contextlib.nullcontext(config)


def _scene(wanted: str | None, folder: Path | None) -> str | None:
    """The scene of a new copy, None for the one that a kept one has.

    Raises ConfigError with the valid ones.
    """
    if wanted is None:
        return None if folder is not None and has_rig(folder) else SCENE
    # Not above: the simulator's rooms take longer to import than other commands to run.
    from services.simulator.scene.catalog import scene_spec

    scene_spec(wanted)
    return wanted


async def _demo(path: Path, shown: Shown, terminal: Terminal) -> Summary:
    stopping = stop_on_signals()
    config = load_rig(path)
    supervisor, metrics = Supervisor(terminal.log), DemoMetrics()
    endpoint = _free_endpoint(config.bus.listen[0])
    with cancelled_by(stopping):
        async with asyncio.TaskGroup() as tasks:
            keepers = [
                tasks.create_task(supervisor.keep_running(child))
                for child in children_of(config, path, viewer=shown.viewer, endpoint=[endpoint])
            ]
            terminal.line(
                f"rig {config.rig.name!r}, scene {config.simulator.scene!r}, "
                f"router at {endpoint}; Ctrl-C ends everything"
            )
            try:
                async with open_bus(config.rig.name, [endpoint]) as bus:
                    await _measure(bus, metrics, shown, terminal, config)
            finally:
                for keeper in keepers:
                    keeper.cancel()
    terminal.end()
    return metrics.summary(dict(supervisor.restarts))


async def _measure(
    bus: Bus, metrics: DemoMetrics, shown: Shown, terminal: Terminal, config: RigConfig
) -> None:
    """Feed the metrics from the bus until the time is over."""
    async with asyncio.TaskGroup() as tasks:
        besides = [*_subscribers(bus, metrics, terminal)]
        if shown.tour:
            narrator = Narrator(bus, terminal, STEPS)
            besides.append(touring(Tour(bus, config, narrator, Evidence(), metrics)))
        started = [tasks.create_task(one) for one in besides]
        await _until_done(metrics, shown.seconds, terminal)
        for task in started:
            task.cancel()


def _subscribers(
    bus: Bus, metrics: DemoMetrics, terminal: Terminal
) -> list[Coroutine[Any, Any, None]]:
    async def poses() -> None:
        async for pose in bus.every(topics.POSE, 256):
            metrics.add_pose(pose, clock.now_ns())

    async def truths() -> None:
        async for truth in bus.every(topics.TRUTH, 256):
            metrics.add_truth(truth)

    async def objects() -> None:
        async for pose in bus.every(topics.OBJECT, 256):
            metrics.objects.add_pose(pose)

    async def contacts() -> None:
        async for message in bus.every(topics.CONTACTS, 256):
            metrics.objects.add_contacts(message)

    async def viewer_port() -> None:
        port = 0
        async for beat in bus.every(topics.HEALTH, 64):
            if beat.service == "viewer" and beat.values.get("port", port) != port:
                port = int(beat.values["port"])
                terminal.line(f"live view: http://127.0.0.1:{port}")

    return [poses(), truths(), objects(), contacts(), viewer_port()]


async def _until_done(metrics: DemoMetrics, seconds: float | None, terminal: Terminal) -> None:
    """Return when the time is over, or when no first pose came in time."""
    waited_s, poses_before = 0.0, 0
    while True:
        await asyncio.sleep(_POLL_S)
        waited_s += _POLL_S
        if seconds is not None:
            if not metrics.poses and waited_s >= _FIRST_POSE_S:
                return
            if metrics.poses and clock.now_ns() - metrics.first_ns >= seconds * 1e9:
                return
        if waited_s % 1.0 == 0.0:
            terminal.status(_status(metrics, poses_before))
            poses_before = metrics.poses


def _status(metrics: DemoMetrics, poses_before: int) -> str:
    if not metrics.poses:
        return "waiting for the first pose ..."
    error_mm = metrics.tip_error_mm(last=30)
    error = "" if error_mm is None else f", tips {error_mm:.1f} mm from truth"
    return f"{metrics.poses - poses_before} poses/s{error}"


def _free_endpoint(wanted: str) -> str:
    """The wanted loopback endpoint, or one on a free port if another router has it.

    A demo should not fail because a second one runs.
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
