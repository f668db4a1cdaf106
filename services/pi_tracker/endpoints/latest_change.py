"""Changes of a setting that is written to a file: one at a time, and about one a second at most.

The first is made at once. Of those that come meanwhile only the newest is made, a second later, and
all who asked are answered then; a card in a Pi would not live long with hundreds of writes a
second. More askers than may wait are refused.
"""

from __future__ import annotations

import asyncio
import shutil
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from rhot.errors import RefusedError
from rhot.files.calibration import save

C = TypeVar("C")

_PERIOD_S = 1.0
# At 200 a second all have their answer; each waits with a few kB.
_MOST_WAITING = 512
# What was in use for so long, somebody was content with; what is replaced sooner was a trial.
_GOOD_S = 60.0


class LatestChange(Generic[C]):
    """Makes changes by `apply`; of two that wait, the later counts, or merge(earlier, later)."""

    def __init__(
        self,
        apply: Callable[[C], Awaitable[None]],
        merge: Callable[[C, C], C] | None = None,
    ) -> None:
        self._apply, self._merge = apply, merge
        self._lock = asyncio.Lock()
        self._pending: C | None = None
        self._answer: asyncio.Future[None] | None = None
        self._waiting = 0
        self._made_s = float("-inf")

    async def make(self, wanted: C) -> None:
        """Return once this change, or a later one, is made; raises what making it raised.

        Raises RefusedError, too, if too many wait.
        """
        if self._waiting >= _MOST_WAITING:
            raise RefusedError(f"{_MOST_WAITING} changes wait already; ask again later", "busy")
        if self._merge is not None and self._pending is not None:
            wanted = self._merge(self._pending, wanted)
        self._pending = wanted
        self._waiting += 1
        try:
            if self._answer is not None:
                await asyncio.shield(self._answer)
            else:
                await self._lead()
        finally:
            self._waiting -= 1

    async def _lead(self) -> None:
        """Make what is pending when its time has come, for all who wait."""
        answer = self._answer = asyncio.get_running_loop().create_future()
        try:
            async with self._lock:
                await asyncio.sleep(max(0.0, self._made_s + _PERIOD_S - time.monotonic()))
                pending, self._pending, self._answer = self._pending, None, None
                self._made_s = time.monotonic()
                if pending is not None:
                    await self._apply(pending)
            answer.set_result(None)
        except asyncio.CancelledError:
            answer.cancel()
            raise
        except Exception as error:
            answer.set_exception(error)
            # Nobody else may have waited, and the leader raises it itself.
            answer.exception()
            raise
        finally:
            if self._answer is answer:
                self._pending = self._answer = None


def write_setting(path: Path, made: msgspec.Struct) -> None:
    """Write a calibration; what was in use for a while is kept beside it as `<name>.bak`."""
    try:
        settled = time.time() - path.stat().st_mtime > _GOOD_S
    except OSError:
        settled = False
    if settled:
        temporary = path.with_name(f".{path.name}.bak")
        shutil.copy2(path, temporary)
        temporary.replace(path.with_name(f"{path.name}.bak"))
    save(path, made)
