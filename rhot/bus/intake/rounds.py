"""Messages asked for in rounds, for a process with many rigs.

To be called back for each message is the quickest for a few: a thread of Zenoh's wakes one of
Python's, which waits for Python's lock and wakes the event loop. With 32 rigs that is 3000 times a
second, and the loop waits for the lock after each message that it sends. There Zenoh keeps messages
in rings, and the loop asks all of them in turn: at once while there is anything, after a pause
where there was nothing (docs/notes/scale.md).
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Protocol

import zenoh

from rhot import clock

# With 32 rigs on two cores, in turn: 99 % of poses within 24 and 29 ms; after 1 ms 33 and 43. (Half
# a millisecond spins: uvloop's timers count whole ones.)
_PAUSE_S = 0.002
# Of one subscription in one round.
_MOST = 256


class Asked(Protocol):
    """Whose messages are asked for."""

    def take_in(self, sample: zenoh.Sample, came_ns: int) -> None:
        """Take one, as if it had come at came_ns. Calls nobody."""
        ...

    def wake(self) -> None:
        """Hand over what was taken."""
        ...


Ask = Callable[[], zenoh.Sample | None]


class Rounds:
    """The rounds of one event loop; they begin with who joins first, and end with who leaves last.

    All are asked before anything is handed over, so that each knows how long it waits. A message is
    taken to have come in the middle between two rounds.
    """

    def __init__(self) -> None:
        self._asked: list[tuple[Ask, Asked]] = []
        self._running = False
        self._last_ns = 0

    def join(self, one: Asked, ask: Ask) -> None:
        """From now on it is asked, by ask, which gives None where there is nothing."""
        self._asked.append((ask, one))
        if not self._running:
            self._running = True
            self._last_ns = time.monotonic_ns()
            asyncio.get_running_loop().call_later(_PAUSE_S, self._go_round)

    def leave(self, one: Asked) -> None:
        """It is asked no more."""
        self._asked = [entry for entry in self._asked if entry[1] is not one]

    def _go_round(self) -> None:
        if not self._asked:
            self._running = False
            return
        loop, found = asyncio.get_running_loop(), list[Asked]()
        since_ns, self._last_ns = self._last_ns, time.monotonic_ns()
        came_ns = clock.now_ns() - (self._last_ns - since_ns) // 2
        try:
            self._ask_all(found, came_ns)
            for one in found:
                one.wake()
        finally:
            if found:
                loop.call_soon(self._go_round)
            else:
                loop.call_later(_PAUSE_S, self._go_round)

    def _ask_all(self, found: list[Asked], came_ns: int) -> None:
        """Take in what has come; found gets those of whom there was any."""
        one: Asked | None = None
        try:
            for ask, one in self._asked:
                # Most have nothing, most of the time: what is done for each is as little as can be.
                sample = ask()
                if sample is not None:
                    found.append(one)
                    self._take_all(sample, ask, one, came_ns)
        except zenoh.ZError:
            # Its session has closed. Who comes behind it is asked in the next round.
            if one is not None:
                self.leave(one)

    @staticmethod
    def _take_all(sample: zenoh.Sample, ask: Ask, one: Asked, came_ns: int) -> None:
        """Take the first of its samples and those behind it; the rest of a flood waits."""
        for _ in range(_MOST):
            one.take_in(sample, came_ns)
            behind = ask()
            if behind is None:
                return
            sample = behind
        one.take_in(sample, came_ns)
