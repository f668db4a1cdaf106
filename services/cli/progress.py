"""One line of progress on standard error, and none where nobody watches: pipes, logs and CI stay clean."""

from __future__ import annotations

import sys
import time

from services.cli.say import Teller


class Progress:
    """Shows `what 120/600 (20 %), 85 frames/s`; shown is None for "only on a terminal"."""

    # A reader cannot follow more than a few numbers a second.
    _EVERY_S = 0.2

    def __init__(self, what: str, total: int, shown: bool | None, teller: Teller | None = None) -> None:
        self._what, self.total, self._count = what, total, 0
        self._teller = teller or Teller()
        self._plain = bool(shown) and not sys.stderr.isatty()
        self._shown = sys.stderr.isatty() if shown is None else shown
        self._started = self._told = time.monotonic()

    def advance(self, count: int = 1) -> None:
        """So many more are done."""
        self._count += count
        now = time.monotonic()
        # Where every line stays (--progress into a file), one each two seconds is enough.
        if self._shown and now - self._told >= (10 if self._plain else 1) * self._EVERY_S:
            self._told = now
            (self._teller.line if self._plain else self._teller.status)(self._text(now))

    def end(self) -> None:
        """Take the line away."""
        if self._shown:
            self._teller.end()

    def _text(self, now: float) -> str:
        share = f"/{self.total} ({100 * self._count // self.total} %)" if self.total else ""
        return f"{self._what} {self._count}{share}, {self._count / max(now - self._started, 1e-3):.0f} frames/s"
