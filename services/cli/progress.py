"""One line of progress on standard error, on a terminal only.

Pipes, logs and CI stay clean unless progress is asked for.
"""

from __future__ import annotations

import sys
import time
from typing import TextIO

from services.cli.terminal import Terminal

# A reader cannot follow more than a few numbers a second; where every line stays, one each two
# seconds is enough.
_STATUS_PERIOD_S, _LINE_PERIOD_S = 0.2, 2.0


class Progress:
    """Shows `what 120/600 (20 %), 85 frames/s`.

    shown None means "on a terminal only"; total, 0 if unknown, may be set when it becomes known;
    unit is what is counted.
    """

    def __init__(
        self,
        what: str,
        total: int,
        shown: bool | None,
        out: TextIO | None = None,
        unit: str = "frames",
    ) -> None:
        out = out or sys.stderr
        is_terminal = out.isatty()
        self.total = total
        self.period_s = _STATUS_PERIOD_S if is_terminal else _LINE_PERIOD_S
        self._what, self._unit, self._count = what, unit, 0
        self._terminal = Terminal(out=out)
        self._print = self._terminal.status if is_terminal else self._terminal.line
        self._shown = is_terminal if shown is None else shown
        self._started_s = self._printed_s = time.monotonic()

    def advance(self, count: int = 1) -> None:
        """So many more are done."""
        self._count += count
        now_s = time.monotonic()
        if self._shown and now_s - self._printed_s >= self.period_s:
            self._printed_s = now_s
            self._print(self._text(now_s))

    def end(self) -> None:
        """Remove the line."""
        if self._shown:
            self._terminal.end()

    def _text(self, now_s: float) -> str:
        share = f"/{self.total} ({100 * self._count // self.total} %)" if self.total else ""
        per_s = self._count / max(now_s - self._started_s, 1e-3)
        return f"{self._what} {self._count}{share}, {per_s:.0f} {self._unit}/s"
