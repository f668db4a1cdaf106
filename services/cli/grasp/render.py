"""`rhot grasp render --out DIR`: videos of fingers that close, with everything known of them.

What the study's other commands are tried on. The same seed gives the same pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rhot.errors import ConfigError, writing
from services.cli.option_groups import grouped
from services.cli.options import ProgressOption

if TYPE_CHECKING:
    from studies.grasp.scene.experiment import Experiment, Options


@dataclass(frozen=True)
class Filmed:
    """What is done, and by whom."""

    subject: Annotated[
        list[str] | None, typer.Option(help="subject-1 .. subject-5; default: all five")
    ] = None
    cycles: Annotated[int, typer.Option(min=1, max=50, help="closings, each with its opening")] = 5
    period: Annotated[float, typer.Option(min=0.4, max=60.0, help="of a cycle, in seconds")] = 4.0
    fps: Annotated[float, typer.Option(min=1.0, max=240.0, help="pictures a second")] = 30.0
    thumb: Annotated[bool, typer.Option(help="a pinch; index and thumb have four dots each")] = (
        False
    )
    sway: Annotated[float, typer.Option(min=0.0, max=5.0, help="of the hand; 0: it rests")] = 1.0
    mirrored: Annotated[bool, typer.Option(help="the hand comes from the right")] = False
    dots: Annotated[
        str, typer.Option(help="black, blue, green, red, white, or none: plain skin")
    ] = "blue"
    seed: Annotated[int, typer.Option(min=0, help="of everything that is random")] = 1


@dataclass(frozen=True)
class Camera:
    """What it is filmed with."""

    size: Annotated[str, typer.Option(help="of the pictures, px")] = "640x480"
    k1: Annotated[float, typer.Option(min=-0.5, max=0.5, help="the lens's distortion")] = -0.18
    k2: Annotated[float, typer.Option(min=-0.5, max=0.5, help="likewise")] = 0.05
    tilt: Annotated[
        float, typer.Option(min=0.0, max=40.0, help="of the camera against the plane, degrees")
    ] = 10.0
    noise: Annotated[float, typer.Option(min=0.0, max=50.0, help="RMS, grey levels")] = 2.5
    behind: Annotated[
        float, typer.Option(min=-50.0, max=45.0, help="rectangle behind the finger's plane, mm")
    ] = 0.0
    video: Annotated[
        Literal["lossy", "lossless", "frames"],
        typer.Option(help="MPEG-4, FFV1, or a folder of PNG"),
    ] = "lossy"


@grouped
def render(
    out: Annotated[Path, typer.Option("--out", "-o", help="new folder")],
    filmed: Filmed,
    camera: Camera,
    progress: ProgressOption = None,
) -> None:
    """Render the study's experiment: five subjects, five cycles each, angles known."""
    # Not above: OpenCV takes longer to import than other commands take to run.
    from services.cli.grasp.film import film
    from services.cli.progress import Progress
    from studies.grasp.scene.experiment import Experiment
    from studies.grasp.scene.subjects import SUBJECTS, subject_named

    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"{out}: is not an empty folder; name a new one")
    options = _options(filmed, camera)
    subjects = [subject_named(name) for name in filmed.subject or []] or list(SUBJECTS)
    # Each has a camera, a wall and habits of its own.
    experiments = [
        Experiment(one, options, 10 * filmed.seed + SUBJECTS.index(one)) for one in subjects
    ]
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
    line = Progress("rendering", sum(map(len, experiments)), progress)
    for experiment in experiments:
        video = film(experiment, out, camera.video, line.advance)
        _write_truth(experiment, out)
        line.end()
        typer.echo(video)


def _options(filmed: Filmed, camera: Camera) -> Options:
    from studies.grasp.scene.backdrop import Rectangle
    from studies.grasp.scene.experiment import DOT_COLOURS, Options
    from studies.grasp.scene.motion import Cycles
    from studies.grasp.scene.view import ViewOptions

    if filmed.dots not in (*DOT_COLOURS, "none"):
        valid = ", ".join((*DOT_COLOURS, "none"))
        raise ConfigError(f"--dots {filmed.dots}: no such colour; valid: {valid}")
    width, _, height = camera.size.partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise ConfigError(f"--size {camera.size}: is no size; give it as 640x480")
    size = (int(width), int(height))
    if not all(64 <= one <= 4096 and one % 2 == 0 for one in size):
        raise ConfigError(f"--size {camera.size}: width and height are even and 64 to 4096 px")
    return Options(
        view=ViewOptions(size, camera.k1, camera.k2, camera.tilt),
        cycles=Cycles(filmed.cycles, filmed.period, filmed.fps, sway=filmed.sway),
        rectangle=Rectangle(z=camera.behind),
        dots=None if filmed.dots == "none" else filmed.dots,
        thumb=filmed.thumb,
        mirrored=filmed.mirrored,
        noise=camera.noise,
    )


def _write_truth(experiment: Experiment, out: Path) -> None:
    """Everything but the video."""
    import msgspec

    from rhot.files.calibration import save
    from studies.grasp.recording import save_recording
    from studies.grasp.scene.truth import lens_of, pixel_table, scene_file, seeds_of, truth_of

    name = experiment.subject.name
    with writing(out):
        for recording in truth_of(experiment):
            thumb = ".thumb" if recording.finger == "thumb" else ""
            save_recording(out / f"{name}{thumb}.truth.json", recording)
        seeds = msgspec.json.encode(seeds_of(experiment))
        (out / f"{name}.seeds.json").write_bytes(seeds + b"\n")
        (out / f"{name}.pixels.csv").write_text(pixel_table(experiment))
        scene = msgspec.json.format(msgspec.json.encode(scene_file(experiment)), indent=1)
        (out / f"{name}.scene.json").write_bytes(scene + b"\n")
    save(out / f"{name}.lens.json", lens_of(experiment))
