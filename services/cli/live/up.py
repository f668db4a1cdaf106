"""`rhot up CONFIG`: the master's processes of a real rig, supervised.

These are router, fusion with the solver in its process, object tracker, viewer, recorder, metrics
and bridges to other programs. Cameras whose `host` is empty are tracked on this machine too; those
of other hosts run `rhot-pi-tracker` there. It says that the rig is up once it is, and otherwise
what is missing and why.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
import uvloop

from rhot.files.config import RigConfig, load_rig
from rhot.hand import HandName
from rhot.process.event_loop import cancelled_by, stop_on_signals
from services.cli.live.supervisor import Child, Supervisor, service_argv
from services.cli.options import VerboseOption
from services.cli.rig.watch import RigWatch
from services.cli.terminal import Terminal


def children_of(
    config: RigConfig, path: Path, *, viewer: bool, endpoint: Sequence[str] = ()
) -> list[Child]:
    """Everything that `rhot up` and `rhot demo` run for a rig.

    endpoint replaces the endpoints of rig.toml.
    """
    common = ["--config", str(path), *(option for e in endpoint for option in ("--connect", e))]
    listen = [option for e in endpoint for option in ("--listen", e)]
    children = [Child("router", service_argv("cli", "router", "--config", str(path), *listen))]
    local = [camera for camera in config.camera if not camera.host]
    # Also for simulated cameras that are tracked on other hosts.
    if any(camera.source == "simulator" for camera in config.camera):
        children.append(Child("simulator", service_argv("simulator", *common)))
    children += [
        Child(f"pi_tracker/{c.name}", service_argv("pi_tracker", *common, "--camera", c.name))
        for c in local
    ]
    # Fusion is the master of session and clock, also where markers alone are tracked.
    fusion = service_argv("fusion", "--solve", *common)
    children.append(Child("fusion", fusion, ("solver",) if config.has_depth else ()))
    if config.object:
        children.append(Child("object_tracker", service_argv("object_tracker", *common)))
    if config.object and config.objects.source == "steamvr" and not config.objects.host:
        children.append(Child("openvr_bridge", service_argv("openvr_bridge", *common)))
    if viewer:
        children.append(Child("viewer", service_argv("viewer", *common)))
        # For the page's guided calibration; idle until somebody starts a step.
        children.append(Child("calibrator", service_argv("calibrator", *common)))
    # Without autostart for the page, which starts, stops and replays recordings.
    if config.recorder.autostart or viewer:
        children.append(Child("recorder", service_argv("recorder", *common, "--on-request")))
    if config.metrics.enabled:
        children.append(Child("metrics", service_argv("metrics", *common)))
    children += [
        Child(f"bridge/{name}", service_argv("bridges", *common, "--instance", name))
        for name in config.bridges.enabled
    ]
    return children


def up(
    config: Annotated[Path, typer.Argument(help="rig.toml of the rig")],
    viewer: Annotated[bool, typer.Option(help="show the rig in a browser")] = True,
    verbose: VerboseOption = False,
) -> None:
    """Run the master's services of a real rig until Ctrl-C."""
    uvloop.run(_up(load_rig(config), config, viewer, Terminal(verbose=verbose)))


def unmeasured_hands(config: RigConfig) -> list[HandName]:
    """Hands of a rig that are tracked with the bones of the tables."""
    if not config.has_depth:
        return []
    folder = config.calibration_dir
    return [hand for hand in config.hand if not (folder / f"hand.{hand}.json").exists()]


async def _up(config: RigConfig, path: Path, viewer: bool, terminal: Terminal) -> None:
    stopping = stop_on_signals()
    supervisor = Supervisor(terminal.log)
    children = children_of(config, path, viewer=viewer)
    with cancelled_by(stopping):
        async with asyncio.TaskGroup() as tasks:
            for child in children:
                tasks.create_task(supervisor.keep_running(child))
            terminal.line(f"starting rig {config.rig.name!r}; Ctrl-C ends it")
            remote = sorted({camera.host for camera in config.camera if camera.host})
            if remote:
                terminal.line(f"cameras expected from {', '.join(remote)}")
            if config.objects.host and config.object:
                terminal.line(f"SteamVR's trackers expected from {config.objects.host}")
            for hand in unmeasured_hands(config):
                terminal.line(
                    f"the {hand} hand was never measured: `rhot calibrate hand {hand} --watch "
                    f"--config {path}` does it while somebody uses the rig"
                )
            services = [name for child in children for name in (child.name, *child.others)]
            watch = RigWatch(config, path, services, terminal.line)
            await watch.run(supervisor.reasons)
