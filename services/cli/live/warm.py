"""`rhot warm`: compile every numba kernel into its cache, before the first start of a service.

Part of `make install`. Kernels are cached in $RHOT_CACHE, systemd's $CACHE_DIRECTORY or
~/.cache/rhot (rhot.kernels.numba_cache); running it again costs seconds. A compiler uses one core:
services share no kernels, and each has a process of its own.
"""

from __future__ import annotations

import importlib
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer

import services
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.config import RigConfig, load_rig
from rhot.hand import HandModel, HandName
from rhot.kernels.numba_cache import adopt, cache_folder, clear_old
from rhot.messages.simulator import SimBoard, SimStage
from services.cli.defaults import sim_toml


def warm(
    config: Annotated[
        Path | None, typer.Option(help="rig.toml; default: the simulated rig's")
    ] = None,
) -> None:
    """Compile all kernels once, ahead of the first start."""
    # Where it is missing, that is said before anything else.
    importlib.import_module("numba")
    package = Path(services.__file__).parent
    adopted = adopt(package)
    started_s = time.monotonic()
    path = config or sim_toml()
    rig = load_rig(path)
    # Those that take longest begin.
    parts = ["solver", "fusion"]
    if any(camera.source == "simulator" for camera in rig.camera):
        parts.append("simulator")
    known = adopted or any(cache_folder(package).rglob("*.nbc"))
    typer.echo(
        f"{'loading' if known else 'compiling'} the kernels of {', '.join(parts)} into"
        f" {cache_folder(package)}{'' if known else ': some minutes, once'}"
    )
    # Processes, as numba compiles in one thread at a time; spawned, as its locks do not survive a
    # fork.
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        jobs = {pool.submit(_warm, part, path): part for part in parts}
        for job in as_completed(jobs):
            typer.echo(f"{jobs[job]}: ready after {job.result():.1f} s")
    clear_old(package)
    typer.echo(f"kernels compiled in {time.monotonic() - started_s:.1f} s")


def _warm(part: str, config: Path) -> float:
    """Compile the kernels of a service, in a process of its own; the seconds it took."""
    started_s = time.monotonic()
    rig = load_rig(config)
    # Only here: `rhot --help` must not wait for numba.
    if part == "simulator":
        from services.simulator.camera.frame_source import FrameSource
        from services.simulator.stage import Stage

        stage = Stage(rig)
        for shown in (SimStage(), SimStage(board=SimBoard())):
            stage.set(shown)
            for camera in rig.camera:
                FrameSource(stage.scene, camera.name).renderer.picture(0)
    elif part == "solver":
        from services.solver.warm import warm_up as warm_solver

        warm_solver(rig, _hands(rig))
    else:
        from services.fusion.warm import warm_up as warm_fusion

        warm_fusion(rig, load_rig_cameras(rig), _hands(rig))
    return time.monotonic() - started_s


def _hands(rig: RigConfig) -> dict[HandName, HandModel]:
    return {
        name: load_hand(rig.calibration_dir, name, table.scale) for name, table in rig.hand.items()
    }
