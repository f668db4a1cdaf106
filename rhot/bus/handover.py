"""Messages between services of one process, handed over as they are.

Through Zenoh such a message is encoded, copied, checked and decoded, for a reader that shares the
memory of who wrote it. It still goes to Zenoh for everybody else; readers of this process take from
Zenoh what comes from other sessions only. Messages do not change, so both may keep one.
"""

from __future__ import annotations

from typing import Any, Protocol

import zenoh


class Reader(Protocol):
    """A subscription to messages of a key expression."""

    @property
    def key(self) -> str: ...

    def hand_over(self, key: str, message: Any, now_ns: int) -> None:
        """Take a message that was published on a key at now_ns; in the event loop."""
        ...


class Handover:
    """Who of a process reads what."""

    def __init__(self) -> None:
        self._readers: list[Reader] = []
        # By the key of a publisher; of those there are some.
        self._of_key: dict[str, tuple[Reader, ...]] = {}

    def join(self, reader: Reader) -> None:
        """From now on it gets what is published on its key."""
        self._readers.append(reader)
        self._of_key = {}

    def leave(self, reader: Reader) -> None:
        """It gets nothing more."""
        self._readers = [one for one in self._readers if one is not reader]
        self._of_key = {}

    def readers(self, key: str) -> tuple[Reader, ...]:
        """Who gets what is published on a key."""
        found = self._of_key.get(key)
        if found is None:
            own = zenoh.KeyExpr(key)
            found = tuple(one for one in self._readers if own.intersects(zenoh.KeyExpr(one.key)))
            self._of_key[key] = found
        return found
