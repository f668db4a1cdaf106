"""Whose turn it is: the thread of the event loop is not interrupted by the process's other threads.

Linux lets a thread that wakes take the processor from the one that runs. Zenoh's threads wake a few
times for every message, do next to nothing, and take Python's lock for some of it, which the loop
then waits for. Scheduled as a batch (`man 7 sched`) a thread has the same share of the processor,
but waits its turn where none is idle. With 32 rigs on two cores fusion's loop was interrupted 4000
times a second, and is 700 times since (docs/notes/scale.md).
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
import threading
from pathlib import Path

_TASKS = Path("/proc/self/task")
# Threads come with sessions and subscriptions, which a service opens as it begins.
_LOOK_EVERY_S = 1.0


async def keep_the_turn() -> None:
    """Schedule all other threads of this process as batches, also those that are still to come.

    For ever; to be awaited by the thread that is not to be interrupted. Elsewhere than on Linux,
    which alone has such threads, it ends at once.
    """
    known: set[int] = set()
    while sys.platform == "linux":
        threads = _threads()
        for thread in threads - known - {threading.get_native_id()}:
            # One that has ended meanwhile, or a system that does not allow it: it goes on as it is.
            with contextlib.suppress(OSError):
                os.sched_setscheduler(thread, os.SCHED_BATCH, os.sched_param(0))
        known = threads
        await asyncio.sleep(_LOOK_EVERY_S)


def _threads() -> set[int]:
    """Ids of this process's threads."""
    return {int(task.name) for task in _TASKS.iterdir()}
