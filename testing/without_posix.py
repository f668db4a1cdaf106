"""A Python that lacks what Windows' lacks, for a process that must also live there.

Imported at a process's start (from a sitecustomize), it takes away the modules and functions that
only POSIX has, for everything but the standard library, which on this machine needs them.
"""

from __future__ import annotations

import asyncio.unix_events
import os
import subprocess  # noqa: F401 - the standard library keeps what it has imported
import sys
from pathlib import Path
from typing import Any

MODULES = ("uvloop", "resource", "fcntl", "pwd", "grp", "termios", "syslog")
FUNCTIONS = ("getloadavg", "statvfs", "getuid", "geteuid", "getpgid", "killpg", "sysconf")


class _Missing:
    """Refuses the modules, as a Python of Windows does."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> None:  # noqa: ARG002
        if name.partition(".")[0] in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def _no_signals(*_: Any) -> None:
    raise NotImplementedError


_read_text = Path.read_text


def _read_no_proc(self: Path, *args: Any, **options: Any) -> str:
    if str(self).startswith(("/proc", "/sys")):
        raise FileNotFoundError(2, "No such file or directory", str(self))
    return _read_text(self, *args, **options)


def take_away() -> None:
    """From here on this process has no POSIX of its own."""
    for name in MODULES:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, _Missing())  # type: ignore[arg-type]
    for name in FUNCTIONS:
        if hasattr(os, name):
            delattr(os, name)
    loop: Any = asyncio.unix_events._UnixSelectorEventLoop  # type: ignore[attr-defined]
    loop.add_signal_handler = loop.remove_signal_handler = _no_signals
    Path.read_text = _read_no_proc  # type: ignore[method-assign]
