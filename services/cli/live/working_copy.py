"""The folder that `rhot demo` works in: a copy of the shipped rig, rig.toml and calibration/.

A running rig writes beside its rig.toml (colours and exposures that were set in the browser). The
installed package must stay as it is, and may be read-only.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from rhot.errors import ConfigError
from services.cli.defaults import sim_toml

_RIG, _CALIBRATION = "rig.toml", "calibration"


@contextlib.contextmanager
def working_copy(folder: Path | None = None) -> Iterator[Path]:
    """The rig.toml of a copy of the shipped simulated rig.

    Without a folder the copy is temporary and removed at the end. A folder is kept; one that holds
    a rig.toml already is used as it is, so that a second run continues with what the first one
    changed. Raises ConfigError if the folder holds anything else or cannot be written.
    """
    if folder is not None:
        if not (folder / _RIG).is_file():
            _copy(folder)
        yield folder / _RIG
        return
    with tempfile.TemporaryDirectory(prefix="rhot-demo-") as temporary:
        _copy(Path(temporary))
        yield Path(temporary) / _RIG


def _copy(folder: Path) -> None:
    shipped = sim_toml()
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
        (folder / _RIG).write_bytes(shipped.read_bytes())
    except OSError as error:
        raise ConfigError(
            f"{folder}: cannot be written: {error}; give another one with --folder DIR"
        ) from None
