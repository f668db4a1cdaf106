"""The folder that `rhot demo` works in: a copy of the shipped rig, rig.toml and calibration/.

A running rig writes beside its rig.toml (colours and exposures that were set in the browser). The
installed package must stay as it is, and may be read-only.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

from rhot.errors import ConfigError
from services.cli.defaults import sim_toml

_RIG, _CALIBRATION = "rig.toml", "calibration"
_SCENE_LINE = re.compile(r'^(\[simulator\]\n(?:.*\n)*?)scene = ".*"$', re.MULTILINE)


@contextlib.contextmanager
def working_copy(folder: Path | None = None, scene: str | None = None) -> Iterator[Path]:
    """The rig.toml of a copy of the shipped simulated rig.

    Without a folder the copy is temporary and removed at the end. A folder is kept; one that holds
    a rig.toml already is used as it is, so that a second run continues with what the first one
    changed. scene replaces the shipped rig's. Raises ConfigError if the folder holds anything else,
    cannot be written, or has a scene of its own where one is given.
    """
    if folder is not None:
        if not has_rig(folder):
            _copy(folder, scene)
        elif scene is not None:
            raise ConfigError(
                f"{folder}: has a {_RIG} already; set `scene` under [simulator] there, or give "
                "--folder a new folder"
            )
        yield folder / _RIG
        return
    with tempfile.TemporaryDirectory(prefix="rhot-demo-") as temporary:
        _copy(Path(temporary), scene)
        yield Path(temporary) / _RIG


def has_rig(folder: Path) -> bool:
    """Whether a folder is one of an earlier run, to be used as it is."""
    return (folder / _RIG).is_file()


def _copy(folder: Path, scene: str | None) -> None:
    shipped = sim_toml()
    rig = shipped.read_text(encoding="utf-8")
    if scene is not None:
        rig = _SCENE_LINE.sub(rf'\1scene = "{scene}"', rig, count=1)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        foreign = sorted(path.name for path in folder.iterdir())
        if foreign:
            raise ConfigError(
                f"{folder}: holds files but no {_RIG} ({', '.join(foreign[:3])}); "
                "give --folder a new or empty folder, or one of an earlier `rhot demo --folder`"
            )
        (folder / _CALIBRATION).mkdir()
        for source in sorted((shipped.parent / _CALIBRATION).glob("*.json")):
            # The bytes alone: a read-only installation must not give a read-only copy.
            (folder / _CALIBRATION / source.name).write_bytes(source.read_bytes())
        # Last of all, as a folder with a rig.toml counts as complete.
        (folder / _RIG).write_text(rig, encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"{folder}: cannot be written: {error}; give another one with --folder DIR"
        ) from None
