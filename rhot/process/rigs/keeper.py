"""Several rigs in one process: each with a bus, a task group and health of its own.

What ends a rig's service ends nothing else: it is said in the rig's name, and the rig starts again,
after an error of a file once a file changes, after a new calibration at once, as systemd and the
hold of a process with one rig do it (rhot/process/restart_hold.py). A signal ends them all.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.process.restart_hold import is_of_a_file, state_of
from rhot.process.rigs.context import PLACE, enter

# An error of a file waits for a file to change, at most so long; any other starts again so much
# later (a bug in a loop: 12 tracebacks a minute).
_HOLD_FILE_S, _HOLD_S = 300.0, 5.0
_LOOK_EVERY_S = 0.5


class RigKeeper:
    """Keeps the rigs of one process alive."""

    def __init__(
        self,
        load: Callable[[Path], RigConfig],
        serve: Callable[[RigConfig], Awaitable[None]],
        explain: Callable[[Exception], bool],
    ) -> None:
        """serve runs a rig's service to its end; explain logs what ended it, and says whether it
        wants to be started again at once.
        """
        self._load, self._serve, self._explain = load, serve, explain
        self._files: dict[str, Path] = {}

    async def keep_all(self, paths: Sequence[Path]) -> None:
        """Serve the rigs of all files until each one's service has ended by itself."""
        async with asyncio.TaskGroup() as tasks:
            for place, path in enumerate(paths):
                tasks.create_task(self._keep(path, place))

    async def _keep(self, path: Path, place: int) -> None:
        PLACE.set(place)
        # Until its file is read, a rig is called as that is, or as the folder of its rig.toml.
        enter(path.parent.name if path.name == "rig.toml" else path.stem)
        while True:
            watched = [path, path.parent / "calibration"]
            began_s, before = time.monotonic(), state_of(watched)
            try:
                config = self._load(path)
                watched[1] = config.calibration_dir
                before = state_of(watched)
                self._claim(config.rig.name, path)
                enter(config.rig.name)
                await self._serve(config)
            except Exception as error:
                if self._explain(error):
                    continue
                hold_s = _HOLD_FILE_S if is_of_a_file(error) else _HOLD_S
                await _changed(watched, before, began_s + hold_s)
            else:
                return

    def _claim(self, name: str, path: Path) -> None:
        """Take the rig's name for a file; raises ConfigError if another one has it."""
        for taken, owner in list(self._files.items()):
            if owner == path and taken != name:
                del self._files[taken]
        owner = self._files.setdefault(name, path)
        if owner != path:
            raise ConfigError(
                f"{path}: the rig is called {name!r}, as that of {owner} is; "
                "every rig of a network has a [rig] name of its own"
            )


async def _changed(
    paths: Sequence[Path], before: list[tuple[str, int, int]], until_s: float
) -> None:
    """Wait until a file is no longer as it was before, at the longest until then."""
    while True:
        await asyncio.sleep(_LOOK_EVERY_S)
        if time.monotonic() >= until_s or state_of(paths) != before:
            return
