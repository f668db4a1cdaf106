"""The rig.toml files that a service is started with: one, several, or all of a folder; and how much
they give it to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rhot.errors import ConfigError
from rhot.files.config import RigConfig, load_rig

# Of the usual rig: two cameras at 30 a second.
_FRAMES_HZ = 60.0


def rig_files(paths: Sequence[Path]) -> list[Path]:
    """Files as they are; folders as their *.toml files, or else the rig.toml of the folders in
    them, by name. Beside other rigs, a folder may be empty: one into which rigs will be put.

    Raises ConfigError for folders without any rig, and for a file that is given twice.
    """
    found = [file for path in paths for file in _files_of(path)]
    if not found:
        folders = ", ".join(map(str, paths))
        raise ConfigError(f"{folders}: no *.toml in this folder; a rig is described by one")
    twice = [path for path in found if found.count(path) > 1]
    if twice:
        raise ConfigError(f"{twice[0]} is given twice; each rig is served once")
    return found


def _files_of(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    return sorted(path.glob("*.toml")) or further_rigs(path)


def further_rigs(folder: Path) -> list[Path]:
    """The rigs of a folder that has a folder for each, by name."""
    return sorted(folder.glob("*/rig.toml"))


def load_of(paths: Sequence[Path]) -> float:
    """How many usual rigs, of two cameras at 30 frames a second, have as many frames as these.

    One whose file cannot be read counts as one.
    """
    return sum(map(_load_of_one, paths))


def have_own_names(paths: Sequence[Path]) -> bool:
    """Whether no two rigs are called the same, as far as their files can be read."""
    names = [config.rig.name for config in map(readable_rig, paths) if config is not None]
    return len(set(names)) == len(names)


def _load_of_one(path: Path) -> float:
    config = readable_rig(path)
    return 1.0 if config is None else sum(one.fps for one in config.camera) / _FRAMES_HZ


def readable_rig(path: Path) -> RigConfig | None:
    """A rig, if its file can be read: what is wrong with it is told when it is served."""
    try:
        return load_rig(path)
    except ConfigError:
        return None
