"""Output of long-running commands on standard error: lines that stay above one status line.

The status line is overwritten on a terminal, and left out elsewhere.
"""

from __future__ import annotations

import sys
from typing import TextIO

from rhot.plain_text import printable

_LEVELS = {"debug": 0, "info": 1, "note": 2, "warning": 2, "error": 3, "critical": 4}


class Terminal:
    """Prints lines and a status; of the services' log only warnings and errors, unless verbose."""

    def __init__(self, *, verbose: bool = False, out: TextIO | None = None) -> None:
        self._out = out or sys.stderr
        self._min_level = _LEVELS["debug"] if verbose else _LEVELS["warning"]
        self._status = ""

    def log(self, name: str, level: str, text: str) -> None:
        """A line of the log of the process `name`."""
        if _LEVELS.get(level, _LEVELS["info"]) >= self._min_level:
            self.line(f"[{name}] {level}: {text}")

    def line(self, text: str) -> None:
        """A line that stays."""
        self._clear()
        # Line by line: a traceback of a child has several.
        for one in text.splitlines() or [""]:
            self._out.write(printable(one) + "\n")
        if self._status:
            self._out.write(self._status)
        self._out.flush()

    def status(self, text: str) -> None:
        """Replace the status line; without effect where the output is no terminal."""
        if not self._out.isatty():
            return
        self._clear()
        self._status = printable(text)
        self._out.write(self._status)
        self._out.flush()

    def end(self) -> None:
        """Remove the status line."""
        self._clear()
        self._status = ""
        self._out.flush()

    def _clear(self) -> None:
        if self._status:
            self._out.write("\r\033[K")
