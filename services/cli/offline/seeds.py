"""`rhot track --seed index_tip=512,300`: where dots of one colour are in the first picture."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from rhot.errors import ConfigError
from rhot.files.config import RigConfig

if TYPE_CHECKING:
    from services.pi_tracker.step import TrackerStep

SeedOption = Annotated[
    list[str] | None,
    typer.Option(
        "--seed",
        metavar="[CAM:]LANDMARK=X,Y",
        help="where a dot of a colour that several landmarks share is in the first picture, px; "
        "with several cameras left:index_tip=512,300",
    ),
]

Seeds = dict[str, tuple[float, float]]


def seeds_of(texts: Sequence[str], config: RigConfig, cameras: Sequence[str]) -> dict[str, Seeds]:
    """Seeds by camera, each by landmark. Raises ConfigError saying what is valid."""
    dots = [name for names in config.dots.values() for name in names]
    if texts and not dots:
        raise ConfigError(
            f"--seed {texts[0]}: no colour of rig.toml is shared by several landmarks; write e.g. "
            'joints = "red" and fingers = ["thumb", "index"] below [hand.right]'
        )
    seeds: dict[str, Seeds] = {name: {} for name in cameras}
    for text in texts:
        left, equals, place = text.partition("=")
        camera, colon, landmark = left.rpartition(":")
        if not colon and len(cameras) > 1:
            raise ConfigError(f"--seed {text}: say of which camera, e.g. {cameras[0]}:{text}")
        camera = camera if colon else cameras[0]
        if camera not in seeds:
            raise ConfigError(
                f"--seed {text}: there is no recording of a camera {camera!r}; there are "
                f"{list(cameras)}"
            )
        if landmark not in dots:
            near = difflib.get_close_matches(landmark, dots, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise ConfigError(
                f"--seed {text}: {landmark!r} is no landmark whose colour others share; {hint}"
                f"Valid: {', '.join(dots)}"
            )
        if landmark in seeds[camera]:
            raise ConfigError(f"--seed {text}: {landmark} of camera {camera!r} is given twice")
        seeds[camera][landmark] = _place(text, place if equals else "")
    return seeds


def dot_notes(trackers: Mapping[str, TrackerStep]) -> list[str]:
    """What a person should know of how dots of one colour were told apart at the start."""
    return [f"camera {name!r}: {note}" for name, step in trackers.items() for note in step.notes]


def _place(text: str, place: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in place.split(","))
    except ValueError:
        x = y = math.nan
    if not (0.0 <= x <= 1e5 and 0.0 <= y <= 1e5):
        raise ConfigError(
            f"--seed {text}: give the dot's place in the picture in px, e.g. index_tip=512,300"
        )
    return x, y
