"""`rhot simulate SCENE --seconds 10 --seed 1 --out DIR`: a virtual rig's recording and its truth.

The same scene, seed and rig give the same bytes. A folder that is not empty is an error, and an
unknown scene lists the valid ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from rhot.errors import ConfigError
from rhot.files.config import RigConfig, load_rig
from services.cli.defaults import sim_toml
from services.cli.options import ProgressOption
from services.cli.progress import Progress
from services.simulator.scene.catalog import SCENES


class Simulated(msgspec.Struct, frozen=True, kw_only=True):
    """What was written: pictures of all cameras, without those that the simulated rig lost."""

    capture: str
    scene: str
    seed: int
    seconds: float
    pictures: int


@dataclass(frozen=True)
class _Recording:
    """What is simulated: see simulate's options of the same names."""

    scene: str
    seconds: float
    seed: int | None
    speed: float | None


def simulate(
    scene: Annotated[
        str | None, typer.Argument(help="a scene's name; `rhot simulate --list` shows them")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="new folder for the capture")
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=3600.0, help="duration of the recording")
    ] = 10.0,
    seed: Annotated[int | None, typer.Option(min=0, help="default: of rig.toml")] = None,
    config: Annotated[
        Path | None,
        typer.Option(help="rig.toml of the simulated rig; default: the one rhot brings along"),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(min=1.0, max=240.0, help="frame rate of all cameras; default: of rig.toml"),
    ] = None,
    speed: Annotated[
        float | None, typer.Option(min=0.05, max=10.0, help="of the motion; default: of rig.toml")
    ] = None,
    scenes: Annotated[bool, typer.Option("--list", help="list the scenes")] = False,
    progress: ProgressOption = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="print what was written, or the scenes, as JSON")
    ] = False,
) -> None:
    """Render a scene through the virtual cameras and write a capture with its truth."""
    if scenes:
        typer.echo(_list(as_json))
        return
    if scene is None or out is None:
        raise ConfigError(
            "`rhot simulate SCENE --out DIR` needs a scene and a folder; "
            f"scenes: {', '.join(SCENES)}"
        )
    recording = _Recording(scene, seconds, seed, speed)
    made = _write(_rig(config, fps), recording, out, progress)
    if as_json:
        typer.echo(msgspec.json.encode(made).decode())
        return
    typer.echo(
        f"{out}: {seconds:g} s of {scene!r}, {made.pictures} pictures; "
        f"next: rhot track {out} --out result"
    )


def _rig(path: Path | None, fps: float | None) -> RigConfig:
    config = load_rig(path or sim_toml())
    if fps is None:
        return config
    return msgspec.structs.replace(
        config, camera=[msgspec.structs.replace(camera, fps=fps) for camera in config.camera]
    )


def _write(config: RigConfig, recording: _Recording, out: Path, progress: bool | None) -> Simulated:
    # Not above: the renderer's numba takes longer to import than other commands take to run.
    from services.simulator.files.capture_writer import write_capture
    from services.simulator.scene.scene import load_scene

    scene = load_scene(config, recording.scene, recording.seed, recording.speed)
    shown, done_before = Progress(f"rhot simulate {recording.scene}:", 0, progress), 0

    def advance(done: int, total: int) -> None:
        nonlocal done_before
        shown.total = total
        shown.advance(done - done_before)
        done_before = done

    try:
        pictures = write_capture(scene, recording.seconds, out, advance)
    finally:
        shown.end()
    return Simulated(
        capture=str(out),
        scene=recording.scene,
        seed=scene.seed,
        seconds=recording.seconds,
        pictures=pictures,
    )


def _list(as_json: bool) -> str:
    if as_json:
        return msgspec.json.encode({name: spec.about for name, spec in SCENES.items()}).decode()
    width = max(len(name) for name in SCENES)
    return "\n".join(f"{name.ljust(width)}  {spec.about}" for name, spec in SCENES.items())
