"""`rhot simulate SCENE --seconds 10 --seed 1 --out DIR`: a virtual rig's recording and its truth.

`--motion FILE` instead of SCENE shows a recorded hand (simulate_motion.py). The same scene, seed
and rig give the same bytes. A folder that is not empty is an error, and an unknown scene lists the
valid ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from rhot.errors import ConfigError
from rhot.files.config import RigConfig, load_rig
from services.cli.defaults import sim_toml
from services.cli.options import ProgressOption
from services.cli.progress import Progress
from services.simulator.scene.catalog import ALSO, SCENES

if TYPE_CHECKING:
    from services.cli.offline.simulate_motion import SimulatedMotion


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

    scene: str | None
    motion: Path | None
    seconds: float | None
    distance_m: float
    seed: int | None
    speed: float | None

    @property
    def name(self) -> str:
        return self.scene or str(self.motion)


Advance = Callable[[int, int], None]
AsJson = Annotated[
    bool, typer.Option("--json", help="print what was written, or the scenes, as JSON")
]


def simulate(
    scene: Annotated[
        str | None, typer.Argument(help="a scene's name; `rhot simulate --list` shows them")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="new folder for the capture")
    ] = None,
    motion: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="instead of a scene, a recorded hand: Leap CSV, Qualisys TSV, truth.jsonl,"
            " poses.jsonl, or a folder with one of the latter",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            max=3600.0,
            help="duration; default: 10, or as long as the recording of --motion, which goes to"
            " and fro beyond that",
        ),
    ] = None,
    distance: Annotated[
        float,
        typer.Option(min=0.1, max=3.0, help="of the hand of --motion from the cameras, in metres"),
    ] = 0.5,
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
    as_json: AsJson = False,
) -> None:
    """Render a scene, or a recorded hand, through the virtual cameras and write a capture."""
    if scenes:
        typer.echo(_list(as_json))
        return
    recording = _Recording(scene, motion, seconds, distance, seed, speed)
    made, text = _written(recording, out, config, fps, progress)
    typer.echo(msgspec.json.encode(made).decode() if as_json else text)


def _written(
    recording: _Recording,
    out: Path | None,
    config: Path | None,
    fps: float | None,
    progress: bool | None,
) -> tuple[Simulated | SimulatedMotion, str]:
    """What was written, and the same in words. Raises ConfigError for a request that is not one."""
    if out is None or (recording.scene is None) == (recording.motion is None):
        raise ConfigError(
            "`rhot simulate SCENE --out DIR` needs a scene and a folder, or --motion FILE instead"
            f" of the scene; scenes: {', '.join(SCENES)}"
        )
    rig = _rig(config, fps)
    shown, done_before = Progress(f"rhot simulate {recording.name}:", 0, progress), 0

    def advance(done: int, total: int) -> None:
        nonlocal done_before
        shown.total = total
        shown.advance(done - done_before)
        done_before = done

    try:
        if recording.motion is not None:
            return _write_motion(rig, recording, recording.motion, out, advance)
        return _write(rig, recording, out, advance)
    finally:
        shown.end()


def _rig(path: Path | None, fps: float | None) -> RigConfig:
    config = load_rig(path or sim_toml())
    if fps is None:
        return config
    return msgspec.structs.replace(
        config, camera=[msgspec.structs.replace(camera, fps=fps) for camera in config.camera]
    )


def _write(
    config: RigConfig, recording: _Recording, out: Path, advance: Advance
) -> tuple[Simulated, str]:
    # Not above: the renderer's numba takes longer to import than other commands take to run.
    from services.simulator.files.capture_writer import write_capture
    from services.simulator.scene.scene import load_scene

    seconds = 10.0 if recording.seconds is None else recording.seconds
    scene = load_scene(config, recording.scene, recording.seed, recording.speed)
    pictures = write_capture(scene, seconds, out, advance)
    made = Simulated(
        capture=str(out), scene=scene.name, seed=scene.seed, seconds=seconds, pictures=pictures
    )
    text = (
        f"{out}: {seconds:g} s of {scene.name!r}, {pictures} pictures; "
        f"next: rhot track {out} --out result"
    )
    return made, text


def _write_motion(
    config: RigConfig, recording: _Recording, motion: Path, out: Path, advance: Advance
) -> tuple[SimulatedMotion, str]:
    # As above.
    from services.cli.offline.simulate_motion import MotionRequest, motion_text, write_motion

    settings = config.simulator
    request = MotionRequest(
        motion,
        recording.seconds,
        recording.distance_m,
        settings.speed if recording.speed is None else recording.speed,
        settings.seed if recording.seed is None else recording.seed,
    )
    made = write_motion(config, request, out, advance)
    return made, motion_text(made)


def _list(as_json: bool) -> str:
    about = {name: spec.about for name, spec in SCENES.items()}
    about |= {name: f"another word for {scene}" for name, scene in ALSO.items()}
    if as_json:
        return msgspec.json.encode(about).decode()
    width = max(len(name) for name in about)
    return "\n".join(f"{name.ljust(width)}  {text}" for name, text in about.items())
