"""sd_notify in a few lines: what a service tells systemd over $NOTIFY_SOCKET.

Does nothing where there is no systemd.
"""

from __future__ import annotations

import os
import socket

from rhot.plain_text import printable
from rhot.process.rigs.context import joined_status

# `systemctl status` shows a line; systemd takes some kB.
_MAX_STATUS = 500
# What systemd gives a start before it asks for more (TimeoutStartSec of the units).
_START_S = 120


class _Start:
    """Whether READY=1 has been sent."""

    over = False


def notify(state: str) -> bool:
    """Send a state such as "READY=1"; whether somebody was there to hear it (sd_notify(3))."""
    _Start.over = _Start.over or "READY=1" in state
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address:
        return False
    # A leading @ stands for the abstract namespace.
    target = "\0" + address[1:] if address.startswith("@") else address
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as channel:
        try:
            channel.sendto(state.encode(), target)
        except OSError:
            return False
    return True


def tell_status(text: str) -> None:
    """What `systemctl status` shows of the current rig.

    As one line: a line break, such as a stranger's message may hold, would begin another field.
    """
    notify(f"STATUS={printable(joined_status(text))[:_MAX_STATUS]}")


def ask_for_time() -> None:
    """Say that the start takes longer, as long as it is not over (the router may be away).

    Not later: it would put off the watchdog as well.
    """
    if not _Start.over:
        notify(f"EXTEND_TIMEOUT_USEC={_START_S * 1_000_000}")


def watchdog_s() -> float | None:
    """How often systemd wants to hear from us: half of WatchdogSec (sd_watchdog_enabled(3)), or
    None.
    """
    usec = os.environ.get("WATCHDOG_USEC", "")
    pid = os.environ.get("WATCHDOG_PID", "")
    if not usec.isdigit() or (pid and pid != str(os.getpid())):
        return None
    return int(usec) * 0.5e-6
