"""One line of progress on standard error, and none where nobody watches: pipes, logs and CI stay
clean.
"""

from __future__ import annotations

import sys
import time
from typing import TextIO

from services.cli.terminal import Teller

# A reader cannot follow more than a few numbers a second; where every line stays, one each two
# seconds is enough.
_TERMINAL_S, _LINES_S = 0.2, 2.0


class Progress:
    """Shows `what 120/600 (20 %), 85 frames/s`.

    shown is None for "on a terminal only"; total, 0 if unknown, may be set when it becomes known.
    """

    def __init__(
        self, what: str, total: int, shown: bool | None, out: TextIO | None = None
    ) -> None:
        out = out or sys.stderr
        terminal = out.isatty()
        self.total = total
        self.every_s = _TERMINAL_S if terminal else _LINES_S
        self._what, self._count = what, 0
        self._teller = Teller(out=out)
        self._tell = self._teller.status if terminal else self._teller.line
        self._shown = terminal if shown is None else shown
        self._started = self._told = time.monotonic()

    def advance(self, count: int = 1) -> None:
        """So many more are done."""
        self._count += count
        now = time.monotonic()
        if self._shown and now - self._told >= self.every_s:
            self._told = now
            self._tell(self._text(now))

    def end(self) -> None:
        """Take the line away."""
        if self._shown:
            self._teller.end()

    def _text(self, now: float) -> str:
        share = f"/{self.total} ({100 * self._count // self.total} %)" if self.total else ""
        return f"{self._what} {self._count}{share}, {self._count / max(now - self._started, 1e-3):.0f} frames/s"
