"""What a child process of the supervisor writes: lines with a level, and why it ended. Pure.

A child that ends for the same reason again and again says so once: the lines of the run before are
not repeated.
"""

from __future__ import annotations

import json
import re
from collections import deque
from collections.abc import Callable

Log = Callable[[str, str], None]

# How our programs refuse to start before they log: wrong options, a missing extra.
_REFUSAL = re.compile(r"rhot[a-z-]*: error: (.*)")
# Enough of a traceback to see what failed and where.
_LAST_LINES = 6
# Between an error and the end that it led to: Zenoh may add a backtrace of this length.
_RECENT_LINES = 60
# What one start of a service can have to say; a run of weeks must not fill the memory.
_SERIOUS_LINES = 50
_SERIOUS = ("warning", "error", "critical")


class ChildOutput:
    """The output of one run of a child; log(level, text) gets each line that is news."""

    def __init__(self, log: Log, before: ChildOutput | None = None) -> None:
        """before is the run that ended just now, if this one follows a failure."""
        self._log = log
        self._known = frozenset(before.serious) if before else frozenset[str]()
        self._last: deque[str] = deque(maxlen=_LAST_LINES)
        self._error, self._lines_since = "", 0
        self.serious: deque[str] = deque(maxlen=_SERIOUS_LINES)

    def take(self, line: str) -> None:
        """One line as the child wrote it."""
        level, text = parsed(line)
        if not text:
            return
        self._last.append(text)
        self._lines_since += 1
        if level in ("error", "critical"):
            self._error, self._lines_since = text, 0
        if level not in _SERIOUS:
            self._log(level, text)
            return
        self.serious.append(text)
        if text not in self._known:
            self._log(level, text)

    @property
    def last_error(self) -> str:
        """The last error, if it is recent enough to be why it ended; else ""."""
        return self._error if self._lines_since <= _RECENT_LINES else ""

    @property
    def reason(self) -> str:
        """Its last error, or its last lines where it gave none; "" if it wrote nothing."""
        return self.last_error or "\n".join(self._last)

    @property
    def last_line(self) -> str:
        """The last line it wrote."""
        return self._last[-1] if self._last else ""


def parsed(line: str) -> tuple[str, str]:
    """(level, text) of a JSON log line; a refusal to start is an error, any other line info."""
    if refusal := _REFUSAL.fullmatch(line):
        return "error", refusal[1]
    try:
        record = json.loads(line)
        text = str(record["text"]) + ("\n" + record["trace"] if "trace" in record else "")
        # What another service says in this one's process.
        whose = f"{record['service']}: " if "service" in record else ""
        return str(record["level"]), whose + text
    except (json.JSONDecodeError, KeyError, TypeError, RecursionError):
        return "info", line
