"""`rhot track --offset right=0.5`: by how much a camera's times are late, given by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import typer

from rhot.errors import ConfigError

OffsetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--offset",
        metavar="CAM=SECONDS",
        help="how much later an instant is in CAM's video than in the first camera's, instead of "
        "what the markers' motion tells",
    ),
]


def offsets_of(texts: Sequence[str], cameras: Sequence[str]) -> dict[str, float]:
    """Offsets by camera, s; cameras are those that are read, the first is the reference.

    Raises ConfigError saying what is valid.
    """
    offsets: dict[str, float] = {}
    for text in texts:
        if len(cameras) < 2:
            raise ConfigError(
                f"--offset {text}: is one camera's against another's, and there is only "
                f"{cameras[0]!r}"
            )
        name, equals, seconds = text.rpartition("=")
        others = list(cameras[1:])
        if not equals:
            raise ConfigError(f"--offset {text}: give CAM=SECONDS, e.g. {others[0]}=0.5")
        if name == cameras[0]:
            raise ConfigError(
                f"--offset {text}: {name!r} is the camera that others are measured against; give "
                f"the offset of {' or '.join(map(repr, others))}, with the other sign"
            )
        if name not in others:
            raise ConfigError(
                f"--offset {text}: there is no recording of a camera {name!r}; there are {others}"
            )
        if name in offsets:
            raise ConfigError(f"--offset {text}: camera {name!r} is given twice")
        try:
            value = float(seconds)
        except ValueError:
            value = math.nan
        if not abs(value) <= 1e6:
            raise ConfigError(f"--offset {text}: give seconds as a number, e.g. {name}=0.5")
        offsets[name] = value
    return offsets
