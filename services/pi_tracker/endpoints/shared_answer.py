"""One piece of work for all who ask while it is done: encoding a picture, say.

A flood of questions costs no more than a few a second, in processor, memory and network: work
begins no sooner than a while after the last, and more askers than may wait are refused.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

from rhot.errors import RefusedError

A = TypeVar("A")


class SharedAnswer(Generic[A]):
    """Answers of `make`, begun at most once in period_s, for at most so many askers at a time."""

    def __init__(
        self, make: Callable[[], Awaitable[A]], period_s: float, most_waiting: int
    ) -> None:
        self._make, self._period_s, self._most = make, period_s, most_waiting
        self._answer: asyncio.Future[A] | None = None
        self._waiting = 0
        self._began_s = float("-inf")

    async def get(self) -> A:
        """The answer; raises RefusedError if too many ask, and what `make` raises."""
        if self._waiting >= self._most:
            raise RefusedError(f"{self._most} questions wait already; ask again later", "busy")
        self._waiting += 1
        try:
            if self._answer is not None:
                return await asyncio.shield(self._answer)
            return await self._work()
        finally:
            self._waiting -= 1

    async def _work(self) -> A:
        """Do the work, for all who ask meanwhile."""
        shared = self._answer = asyncio.get_running_loop().create_future()
        try:
            await asyncio.sleep(max(0.0, self._began_s + self._period_s - time.monotonic()))
            self._began_s = time.monotonic()
            answer = await self._make()
        except asyncio.CancelledError:
            shared.cancel()
            raise
        except Exception as error:
            shared.set_exception(error)
            # Nobody else may have asked, and this asker raises it itself.
            shared.exception()
            raise
        else:
            shared.set_result(answer)
            return answer
        finally:
            self._answer = None
