"""How a service holds itself back before it ends with an error, so that systemd does not spin.

systemd starts a service again at once, which is right for a crash, and wrong for a file that is
missing: that would be a try a second for ever, each with its lines in the journal (and systemd 252
of Debian 12 cannot wait longer from try to try). So an error of a file waits until a file changes,
and whatever else ends a service in its first seconds waits a little. Meanwhile `systemctl status`
shows the error. Units set $RHOT_HOLD_S, the longest wait; nothing else does.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from pathlib import Path

from rhot.errors import CalibrationError, ConfigError, leaves
from rhot.process import systemd

# Who lived longer was not stopped by its start: it comes back at once.
_SETTLED_S = 10.0
# A camera that is not plugged in, a bug: with a Pi's start of three seconds, 10 lines a minute.
_BRIEF_S = 5.0
# A new calibration counts within a second.
_LOOK_EVERY_S = 0.5


def hold_s(lived_s: float, *, of_a_file: bool) -> float:
    """How long to wait before ending; 0 where systemd did not start us."""
    longest_s = os.environ.get("RHOT_HOLD_S", "")
    if not longest_s.isdigit():
        return 0.0
    if of_a_file:
        return float(longest_s)
    return 0.0 if lived_s >= _SETTLED_S else min(_BRIEF_S, float(longest_s))


def hold_back(error: Exception, lived_s: float, files: Iterable[Path]) -> None:
    """Wait as long as the error that ends a service after lived_s asks for, or until one of the
    files and folders changes.

    A signal ends the process as usual. systemd sees the error, and that we are alive.
    """
    first = next(leaves(error))
    watched = list(files)
    until_s = time.monotonic() + hold_s(lived_s, of_a_file=is_of_a_file(error))
    before = state_of(watched)
    status = f"STATUS={' '.join(str(first).split())} (tried again once a file changes, or later)"
    while time.monotonic() < until_s and state_of(watched) == before:
        systemd.notify(f"{status}\nWATCHDOG=1")
        systemd.ask_for_time()
        time.sleep(_LOOK_EVERY_S)


def is_of_a_file(error: Exception) -> bool:
    """Whether a changed file may mend it."""
    return any(isinstance(end, ConfigError | CalibrationError) for end in leaves(error))


def state_of(paths: Iterable[Path]) -> list[tuple[str, int, int]]:
    """What changes when a file comes, goes, is written or may be read (its change time)."""
    found = []
    for path in paths:
        inside = sorted(path.iterdir()) if path.is_dir() and os.access(path, os.R_OK) else []
        for one in (path, *inside):
            try:
                facts = one.stat()
            except OSError:
                continue
            found.append((str(one), facts.st_ctime_ns, facts.st_size))
    return found
