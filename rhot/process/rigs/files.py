"""The rig.toml files that a service is started with: one, several, or all of a folder; and how much
they give it to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rhot.errors import ConfigError
from rhot.files.config import load_rig

# Of the usual rig: two cameras at 30 a second.
_FRAMES_HZ = 60.0


def rig_files(paths: Sequence[Path]) -> list[Path]:
    """Files as they are, folders as their *.toml files, by name.

    Raises ConfigError for a folder without any, and for a file that is given twice.
    """
    found: list[Path] = []
    for path in paths:
        files = sorted(path.glob("*.toml")) if path.is_dir() else [path]
        if not files:
            raise ConfigError(f"{path}: no *.toml in this folder; a rig is described by one")
        found += files
    twice = [path for path in found if found.count(path) > 1]
    if twice:
        raise ConfigError(f"{twice[0]} is given twice; each rig is served once")
    return found


def load_of(paths: Sequence[Path]) -> float:
    """How many usual rigs, of two cameras at 30 frames a second, have as many frames as these.

    One whose file cannot be read counts as one: what is wrong with it is told when it is served.
    """
    return sum(map(_load_of_one, paths))


def _load_of_one(path: Path) -> float:
    try:
        return sum(camera.fps for camera in load_rig(path).camera) / _FRAMES_HZ
    except ConfigError:
        return 1.0
