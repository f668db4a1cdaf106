"""What long-running commands print: events on standard error, one status line that is overwritten
on a terminal.
"""

from __future__ import annotations

import sys
from typing import TextIO

_LEVELS = {"debug": 0, "info": 1, "warning": 2, "error": 3, "critical": 4}


class Teller:
    """Prints lines and a status; children's log below warning only if verbose."""

    def __init__(self, *, verbose: bool = False, out: TextIO | None = None) -> None:
        self._out = out or sys.stderr
        self._least = 0 if verbose else 2
        self._status = ""

    def child(self, name: str, level: str, text: str) -> None:
        """A child's log line."""
        if _LEVELS.get(level, 1) >= self._least:
            self.line(f"[{name}] {level}: {text}")

    def line(self, text: str) -> None:
        """A line that stays."""
        self._clear()
        self._out.write(text + "\n")
        if self._status:
            self._out.write(self._status)
        self._out.flush()

    def status(self, text: str) -> None:
        """The status line; nothing where nobody watches."""
        if not self._out.isatty():
            return
        self._clear()
        self._status = text
        self._out.write(text)
        self._out.flush()

    def end(self) -> None:
        """Leave the terminal as it was."""
        self._clear()
        self._status = ""
        self._out.flush()

    def _clear(self) -> None:
        if self._status:
            self._out.write("\r\033[K")
