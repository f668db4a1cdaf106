"""`rhot init [FOLDER/rig.toml]`: a commented rig.toml, from questions or from options."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from rhot.errors import ConfigError
from rhot.files.config import load_rig
from rhot.hand import HandName
from services.cli.init.choices import (
    CameraChoice,
    Choices,
    camera_choice,
    default_markers,
    hands_choice,
    host_choice,
    markers_choice,
    name_choice,
    objects_choice,
    size_choice,
)
from services.cli.init.next_steps import next_steps
from services.cli.init.questions import Questions
from services.cli.init.rig_text import rig_text
from services.cli.option_groups import grouped
from services.cli.rig.machine import own_address

_FILE = "rig.toml"
_PIS = "left=pi-left.local right=pi-right.local"


@dataclass(frozen=True)
class InitOptions:
    """What can be said instead of being asked for; None where it was not."""

    name: Annotated[str | None, typer.Option(help="name of the rig; default: desk")] = None
    camera: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=WHERE",
            help="a camera: NAME=HOST, NAME=SOURCE for one of this machine, or NAME=SOURCE@HOST; "
            f"repeatable; default: {_PIS}",
        ),
    ] = None
    master: Annotated[
        str | None,
        typer.Option(help="the master's name or address as the Pis see it; default: this machine"),
    ] = None
    hand: Annotated[str | None, typer.Option(help="right, left, both, or none; default: right")] = (
        None
    )
    markers: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LANDMARK=COLOUR,...",
            help="paint of the hand; given twice, of the right and the left one",
        ),
    ] = None
    fps: Annotated[float | None, typer.Option(help="pictures a second; default: 30")] = None
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="size of pictures in px; default: 640x480")
    ] = None
    objects: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=SERIAL", help="an object and its tracker; repeatable"),
    ] = None


@grouped
def init(
    options: InitOptions,
    config: Annotated[Path, typer.Argument(help="the file to write, or the folder for it")] = Path(
        _FILE
    ),
    yes: Annotated[bool, typer.Option("--yes", "-y", help="ask nothing, take defaults")] = False,
) -> None:
    """Write the rig.toml of a new rig: asks for what no option says."""
    path = config / _FILE if config.is_dir() or not config.suffix else config
    _refuse_to_overwrite(path)
    # On a terminal only: elsewhere nobody is there to answer.
    choices = choose(options, Questions(asks=sys.stdin.isatty() and not yes))
    _write(path, rig_text(choices))
    typer.echo(f"{path} is written. Next:\n\n{next_steps(path, choices)}")


def choose(options: InitOptions, questions: Questions) -> Choices:
    """The choices, from options and answers."""
    answer = questions.answer
    name = answer("Name of the rig", options.name, "desk", name_choice)
    given = None if options.camera is None else " ".join(options.camera)
    cameras = answer("Cameras, NAME=HOST or NAME=SOURCE", given, _PIS, _cameras)
    remote = next((camera.host for camera in cameras if camera.host), None)
    master = ""
    if remote:
        default = own_address(remote)
        if not default and options.master is None:
            raise ConfigError(
                "this machine has no address on a network: name the master with --master"
            )
        question = "The master's name or address, as the Pis see it"
        master = answer(question, options.master, default, host_choice)
    hands = answer("Painted hand: right, left, both or none", options.hand, "right", hands_choice)
    fps = answer("Pictures a second", None if options.fps is None else str(options.fps), "30", _fps)
    return Choices(
        name=name,
        cameras=cameras,
        master=master,
        markers=_markers(hands, options.markers or [], questions),
        fps=fps,
        size_px=answer("Size of the pictures", options.size, "640x480", size_choice),
        objects=answer(
            "Objects with a Vive tracker, NAME=SERIAL, or nothing",
            None if options.objects is None else " ".join(options.objects),
            "",
            lambda text: objects_choice(text.split()),
        ),
    )


def _cameras(text: str) -> tuple[CameraChoice, ...]:
    cameras = tuple(camera_choice(one) for one in text.split())
    names = [camera.name for camera in cameras]
    if not cameras or len(set(names)) < len(names):
        raise ConfigError("a rig has a camera or more, and each has a name of its own")
    return cameras


def _markers(
    hands: tuple[HandName, ...], given: list[str], questions: Questions
) -> dict[HandName, dict[str, str]]:
    if len(given) > len(hands):
        raise ConfigError(f"--markers is given {len(given)} times, for {len(hands)} hands")
    found = {}
    for index, hand in enumerate(hands):
        default = ",".join(f"{mark}={color}" for mark, color in default_markers(index).items())
        one = given[index] if index < len(given) else None
        found[hand] = questions.answer(f"Paint of the {hand} hand", one, default, markers_choice)
    return found


def _fps(text: str) -> float:
    try:
        fps = float(text)
    except ValueError:
        fps = 0.0
    if not 0.0 < fps <= 240.0:
        raise ConfigError(f"{text!r} is no frame rate; valid: above 0, up to 240")
    return fps


def _refuse_to_overwrite(path: Path) -> None:
    if path.exists():
        raise ConfigError(
            f"{path} is there already, and people write that file: change it with an editor, "
            "or name another place"
        )


def _write(path: Path, text: str) -> None:
    """Write the file whole, once the reader of all services has taken it."""
    temporary = path.with_name(f".{path.name}.new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(text, encoding="utf-8")
        try:
            load_rig(temporary)
            # A link, unlike a rename, does not replace what somebody else has put there meanwhile.
            os.link(temporary, path)
        finally:
            temporary.unlink()
    except FileExistsError:
        _refuse_to_overwrite(path)
        raise
    except ConfigError as error:
        raise ConfigError(str(error).replace(f"{temporary}: ", "")) from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error}") from None
