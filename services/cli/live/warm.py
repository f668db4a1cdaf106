"""`rhot warm`: compile every numba kernel into its cache, before the first start of a service.

Part of `make install`. Kernels are cached in $RHOT_CACHE, systemd's $CACHE_DIRECTORY or
~/.cache/rhot (rhot.process.numba_cache); running it again costs a second.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

import services
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.config import load_rig
from rhot.process.numba_cache import adopt, clear_old
from services.cli.defaults import sim_toml


def warm(
    config: Annotated[
        Path | None, typer.Option(help="rig.toml; default: the simulated rig's")
    ] = None,
) -> None:
    """Compile all kernels once, ahead of the first start."""
    package = Path(services.__file__).parent
    adopt(package)
    # Only here: `rhot --help` must not wait for numba.
    from services.fusion.warm import warm_up as warm_fusion
    from services.simulator.camera.frame_source import FrameSource
    from services.simulator.scene.scene import load_scene
    from services.solver.warm import warm_up as warm_solver

    started_s = time.monotonic()
    rig = load_rig(config or sim_toml())
    hands = {
        name: load_hand(rig.calibration_dir, name, table.scale) for name, table in rig.hand.items()
    }
    names = [camera.name for camera in rig.camera]
    warm_solver(rig, hands)
    warm_fusion(rig, load_rig_cameras(rig), hands)
    if any(camera.source == "simulator" for camera in rig.camera):
        scene = load_scene(rig)
        for name in names:
            FrameSource(scene, name).take(0)
    clear_old(package)
    typer.echo(f"kernels compiled in {time.monotonic() - started_s:.1f} s")
