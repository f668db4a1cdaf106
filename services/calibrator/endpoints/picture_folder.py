"""A folder for pictures while a step goes on; what a killed calibrator has left of one goes with
the next.
"""

from __future__ import annotations

import contextlib
import fcntl
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

_PREFIX, _LOCK = "board-pictures-", "lock"


@contextlib.contextmanager
def picture_folder() -> Iterator[Path]:
    """An empty folder that is gone after the block. Its lock tells others that it is in use."""
    _clear_abandoned()
    with (
        tempfile.TemporaryDirectory(prefix=_PREFIX) as name,
        (Path(name) / _LOCK).open("w") as lock,
    ):
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield Path(name)


def _clear_abandoned() -> None:
    """Remove folders whose process is gone: the system has released their locks."""
    for folder in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        # Another user's, or one that is being made or removed just now, is left alone.
        with contextlib.suppress(OSError), (folder / _LOCK).open() as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
