"""What every way to another program has in common."""

from __future__ import annotations

from typing import Protocol


class Link(Protocol):
    """Sends what can go at once and drops the rest; nothing waits for it."""

    sent: int
    dropped: int

    @property
    def status(self) -> str:
        """For people."""
        ...

    def send(self, data: bytes, /) -> None:
        """Send one frame whole, or drop it."""
        ...
