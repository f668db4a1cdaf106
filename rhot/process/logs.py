"""How a process logs: for a person on a terminal, for the journal, or as JSON for a supervisor.

RHOT_LOG_FORMAT is `text` (the default) or `json`; RHOT_LOG sets the level (default info). Text has
the time, except in the journal, which has its own; there each line begins with its priority
(sd-daemon(3)). Where a process serves several rigs, the line names the rig; where it serves another
service as well, what that one says names it. One record is one line, and control characters of
strangers' texts are spaces; only a traceback, which is a bug's, has several.
"""

from __future__ import annotations

import json
import logging
import os
import sys
from abc import ABC, abstractmethod
from typing import TextIO

from rhot.errors import ConfigError
from rhot.plain_text import printable
from rhot.process.rigs.context import RIG, SERVICE, who

FORMAT = "RHOT_LOG_FORMAT"
_FORMATS = ("text", "json")
_LEVELS = ("debug", "info", "warning", "error", "critical")
# sd-daemon(3): 2 critical, 3 error, 4 warning, 6 informational, 7 debug.
_PRIORITY = {"DEBUG": 7, "INFO": 6, "WARNING": 4, "ERROR": 3, "CRITICAL": 2}


def set_up(who: str, out: TextIO | None = None) -> None:
    """Log as the environment says, on standard output; who names the process, e.g. "fusion/main".

    Raises ConfigError on a value of RHOT_LOG or RHOT_LOG_FORMAT that is none.
    """
    out = out or sys.stdout
    wanted, level = _chosen(FORMAT, "text", _FORMATS), _chosen("RHOT_LOG", "info", _LEVELS)
    handler = logging.StreamHandler(out)
    if wanted == "json":
        handler.setFormatter(_JsonLines(who))
    elif is_journal(out):
        handler.setFormatter(_JournalLines())
    else:
        # In a file the day matters; on a terminal it is today.
        handler.setFormatter(_TimedLines(who, "%H:%M:%S" if out.isatty() else "%Y-%m-%d %H:%M:%S"))
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)


def set_up_command(program: str) -> None:
    """Log warnings as `rhot: text` on standard error, for a person who waits for a command.

    In the journal (`rhot router` as a service) as services do. Raises ConfigError likewise.
    """
    if is_journal(sys.stderr):
        set_up(program, sys.stderr)
        return
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_CommandLines(program))
    logging.basicConfig(level="WARNING", handlers=[handler])


def _chosen(variable: str, default: str, valid: tuple[str, ...]) -> str:
    value = os.environ.get(variable) or default
    if value.lower() not in valid:
        raise ConfigError(f"{variable}={printable(value)}: unknown; valid: {', '.join(valid)}")
    return value.lower()


def is_journal(out: TextIO) -> bool:
    """Whether what is written there goes to systemd's journal (systemd.exec(5))."""
    try:
        status = os.fstat(out.fileno())
    except (OSError, ValueError):
        return False
    return os.environ.get("JOURNAL_STREAM", "") == f"{status.st_dev}:{status.st_ino}"


class _JsonLines(logging.Formatter):
    """One JSON object a line, for who reads with a program."""

    def __init__(self, who: str) -> None:
        super().__init__()
        self._who = who

    def format(self, record: logging.LogRecord) -> str:
        line = {
            "time": self.formatTime(record),
            "level": record.levelname.lower(),
            "who": self._who,
            "text": printable(record.getMessage()),
        }
        names = {"rig": RIG.get(), "service": SERVICE.get()}
        line |= {what: name for what, name in names.items() if name}
        if record.exc_info:
            line["trace"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=False)


class _Lines(logging.Formatter, ABC):
    """The record's line, and those of its traceback, each behind the same beginning."""

    @abstractmethod
    def start(self, record: logging.LogRecord) -> str:
        """What stands before each line."""

    def format(self, record: logging.LogRecord) -> str:
        lines = [record.getMessage()]
        if record.exc_info:
            lines += self.formatException(record.exc_info).splitlines()
        start = self.start(record)
        return "\n".join(start + printable(line) for line in lines)


class _JournalLines(_Lines):
    """`<4>text`: the journal knows time, host and unit itself."""

    def start(self, record: logging.LogRecord) -> str:
        name = who()
        return f"<{_PRIORITY.get(record.levelname, 6)}>{f'{name}: ' if name else ''}"


class _TimedLines(_Lines):
    """`12:03:11 fusion/main warning: text`."""

    def __init__(self, who: str, time_format: str) -> None:
        super().__init__(datefmt=time_format)
        self._who = who

    def start(self, record: logging.LogRecord) -> str:
        level = "" if record.levelname == "INFO" else f" {record.levelname.lower()}"
        return f"{self.formatTime(record, self.datefmt)} {who(self._who)}{level}: "


class _CommandLines(_Lines):
    """`rhot: text`."""

    def __init__(self, program: str) -> None:
        super().__init__()
        self._program = program

    def start(self, record: logging.LogRecord) -> str:  # noqa: ARG002 - alike for all records
        return f"{self._program}: "
