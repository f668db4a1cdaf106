"""The rig.toml files that a service is started with: one, several, or all of a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rhot.errors import ConfigError


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
