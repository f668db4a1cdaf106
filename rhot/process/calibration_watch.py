"""Calibration that a service has loaded, watched: when its files change, the service ends with
EXIT_AGAIN, to be started anew with them.

One way for every rig: the service itself knows which files it loaded, and `rhot up` and systemd
both start again what ends. (A path unit of systemd would need the list of files a second time, and
`rhot up` a watcher of its own.) New files that are broken do not end it: it goes on with what it
has, and says so until they are mended.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

from rhot.errors import CalibrationError
from rhot.process.service import Service

T = TypeVar("T")

# Files are looked at so often; new ones count once they have stood still for as long, since a
# calibration writes several.
_PERIOD_S = 1.0
_FAULT, _SUBJECT = "not_calibrated", "calibration"

# Which file it is and when it was last written; None while there is none.
Stamp = tuple[int, int, int] | None


class CalibrationChangedError(Exception):
    """Ends a service that is to be started anew with the calibration there is now."""


def load_and_watch(service: Service, paths: Iterable[Path], load: Callable[[], T]) -> T:
    """What load() makes of the files at paths, some of which may not be there yet.

    As long as the calling task runs: once the files have changed, and load() still takes them, the
    service ends with CalibrationChangedError.
    """
    # Before they are read: a change while the service starts, which may take a minute, counts.
    loaded = _stamps(paths)
    result = load()
    watch = service.tasks.create_task(_end_on_change(service, loaded, load))
    if (caller := asyncio.current_task()) is not None:
        # A service that has done its work must not be kept alive by its watch.
        caller.add_done_callback(lambda _: watch.cancel())
    return result


async def _end_on_change(
    service: Service, loaded: dict[Path, Stamp], load: Callable[[], object]
) -> None:
    """Wait until the files differ from the loaded ones and can be read."""
    seen = rejected = loaded
    while True:
        await service.turn(_PERIOD_S)
        before, seen = seen, _stamps(loaded)
        if seen == loaded:
            service.faults.clear(_FAULT, _SUBJECT)
        elif seen == before and seen != rejected:
            changed = ", ".join(path.name for path in loaded if seen[path] != loaded[path])
            try:
                await asyncio.to_thread(load)
            except CalibrationError as error:
                rejected = seen
                text = f"new {changed} cannot be used, the old one still is: {error}"
                service.faults.report(_FAULT, text, _SUBJECT)
            else:
                raise CalibrationChangedError(f"{changed} changed: starting again with it")


def _stamps(paths: Iterable[Path]) -> dict[Path, Stamp]:
    return {path: _stamp(path) for path in paths}


def _stamp(path: Path) -> Stamp:
    try:
        found = path.stat()
    except OSError:
        return None
    # The inode too: a file that replaces another may bring an old time along (cp -p, rsync).
    return found.st_ino, found.st_mtime_ns, found.st_size
