"""Messages asked for in rounds, for a process with many rigs.

To be called back for each message is the quickest for a few: a thread of Zenoh's wakes one of
Python's, which waits for Python's lock and wakes the event loop. With 32 rigs that is 3000 times a
second, and the loop waits for the lock after each message that it sends. There Zenoh keeps messages
in rings, and the loop asks all of them in turn: at once while there is anything, after a pause
where there was nothing (docs/notes/scale.md). Most subscriptions hear nothing for minutes: who has
had no message for a second is asked now and then only, with all others.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import zenoh

from rhot import clock

# With 32 rigs on two cores, in turn: 99 % of poses within 24 and 29 ms; after 1 ms 33 and 43. (Half
# a millisecond spins: uvloop's timers count whole ones.)
_PAUSE_S = 0.002
# Of one subscription in one round.
_MOST = 256
# All are asked so often: a round of 16 rigs asks 130, of whom 16 have cameras, and took 70 us.
_ALL_NS = 20_000_000
# Who had nothing for so long is asked then only.
_AT_REST_NS = 1_000_000_000


class Asked(Protocol):
    """Whose messages are asked for."""

    def take_in(self, sample: zenoh.Sample, came_ns: int) -> None:
        """Take one, as if it had come at came_ns. Calls nobody."""
        ...

    def wake(self) -> None:
        """Hand over what was taken."""
        ...


Ask = Callable[[], zenoh.Sample | None]


@dataclass(eq=False)
class _Entry:
    """Who is asked, how, and when it last had anything (time.monotonic_ns)."""

    one: Asked
    ask: Ask
    heard_ns: int


class Rounds:
    """The rounds of one event loop; they begin with who joins first, and end with who leaves last.

    All are asked before anything is handed over, so that each knows how long it waits. A message is
    taken to have come in the middle between two times that it was asked for.
    """

    def __init__(self) -> None:
        self._all: list[_Entry] = []
        # Those that are asked in every round.
        self._busy: list[_Entry] = []
        self._running = False
        # When the busy ones were asked last, and all of them.
        self._last_ns = self._last_of_all_ns = 0

    def join(self, one: Asked, ask: Ask) -> None:
        """From now on it is asked, by ask, which gives None where there is nothing."""
        now_ns = time.monotonic_ns()
        entry = _Entry(one, ask, now_ns)
        self._all.append(entry)
        self._busy.append(entry)
        if not self._running:
            self._running = True
            self._last_ns = self._last_of_all_ns = now_ns
            asyncio.get_running_loop().call_later(_PAUSE_S, self._go_round)

    def leave(self, one: Asked) -> None:
        """It is asked no more."""
        self._all = [entry for entry in self._all if entry.one is not one]
        self._busy = [entry for entry in self._busy if entry.one is not one]

    def _go_round(self) -> None:
        if not self._all:
            self._running = False
            return
        loop, found, now_ns = asyncio.get_running_loop(), list[Asked](), time.monotonic_ns()
        since_ns, self._last_ns = self._last_ns, now_ns
        try:
            if now_ns - self._last_of_all_ns >= _ALL_NS:
                self._ask_those_at_rest(found, now_ns)
            self._ask(self._busy, found, now_ns, since_ns)
            for one in found:
                one.wake()
        finally:
            if found:
                loop.call_soon(self._go_round)
            else:
                loop.call_later(_PAUSE_S, self._go_round)

    def _ask_those_at_rest(self, found: list[Asked], now_ns: int) -> None:
        """Ask who is not asked in every round, and find anew who is to be."""
        since_ns, self._last_of_all_ns = self._last_of_all_ns, now_ns
        busy = set(self._busy)
        self._ask([entry for entry in self._all if entry not in busy], found, now_ns, since_ns)
        # Whoever was found has been asked: that a busy one is asked again does no harm.
        self._busy = [entry for entry in self._all if now_ns - entry.heard_ns < _AT_REST_NS]

    def _ask(self, asked: list[_Entry], found: list[Asked], now_ns: int, since_ns: int) -> None:
        """Take in what has come since then; found gets those of whom there was any."""
        came_ns = clock.now_ns() - (now_ns - since_ns) // 2
        entry: _Entry | None = None
        try:
            for entry in asked:
                # Most have nothing, most of the time: what is done for each is as little as can be.
                sample = entry.ask()
                if sample is not None:
                    entry.heard_ns = now_ns
                    found.append(entry.one)
                    self._take_all(sample, entry.ask, entry.one, came_ns)
        except zenoh.ZError:
            # Its session has closed. Who comes behind it is asked in the next round.
            if entry is not None:
                self.leave(entry.one)

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
