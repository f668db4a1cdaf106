"""The rigs of a service in several processes: Python does one thing at a time in each.

A fusion of 32 rigs has more to do than one core does in time, while others idle. So a service that
is given more rigs than fit a process starts itself once for each share of them. A process that dies
(a crash, no memory) takes its share along and starts again; the others go on.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from rhot.errors import RhotError
from rhot.process.event_loop import end_process, ending_with_parent
from rhot.process.rigs.relayed_notes import RelayedNotes

log = logging.getLogger("rhot.rigs")

# A process that died starts again so much later, as a rig does (keeper.py).
_HOLD_S = 5.0
# A process that is told to end and does not is killed; systemd would, a little later.
_END_S = 8.0
# How a process ends that the user alone can mend (rhot/process/lifecycle.py): a missing extra.
_USER = 2


def in_shares(files: Sequence[Path], wanted: int) -> list[list[Path]]:
    """Files in so many shares as equal as can be, or one for each of this computer's processors."""
    parts = max(min(wanted, os.cpu_count() or 1, len(files)), 1)
    return [list(files[part::parts]) for part in range(parts)]


async def keep_shares(
    shares: Sequence[Sequence[Path]], command_of: Callable[[Sequence[Path]], list[str]]
) -> None:
    """A process for each share, until each has ended by itself; cancelled, it ends them all.

    command_of tells the command that serves some files.
    """
    with (
        tempfile.TemporaryDirectory(prefix="rhot-") as folder,
        contextlib.closing(RelayedNotes(Path(folder), len(shares))) as notes,
    ):
        async with asyncio.TaskGroup() as tasks:
            for number, files in enumerate(shares):
                tasks.create_task(_keep(number, files, command_of(files), notes))


async def _keep(
    number: int, files: Sequence[Path], command: Sequence[str], notes: RelayedNotes
) -> None:
    """Start the process of a share, again and again where it dies."""
    while True:
        process = await asyncio.create_subprocess_exec(
            *command,
            env={**os.environ, **notes.environment(number)},
            preexec_fn=ending_with_parent() if sys.platform == "linux" else None,
        )
        try:
            code = await process.wait()
        finally:
            await asyncio.shield(end_process(process, _END_S))
            notes.forget(number)
        if code == 0:
            return
        rigs = ", ".join(path.stem for path in files)
        if code == _USER:
            raise RhotError(f"the process of {rigs} cannot begin; it says why")
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"code {code}"
        log.error("the process of %s ended with %s; it starts again in %g s", rigs, how, _HOLD_S)
        await asyncio.sleep(_HOLD_S)
