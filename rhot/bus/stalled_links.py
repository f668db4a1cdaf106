"""Connections that a router gives up soon after the other side falls silent.

A host whose cable is out for some seconds is connected again half a second after its return, but
the router goes on with the old connection, and the host's new one is not served, until TCP itself
gives up what it has to send: with a retransmission up to as long after the return as the cable was
out (measured: 11.7 s after 15 s). Zenoh has no setting for it; Linux has one for each socket, which
a listening socket hands on to those it accepts.
"""

from __future__ import annotations

import contextlib
import os
import socket
from pathlib import Path

# Longer than the lease after which Zenoh itself gives a silent peer up (zenoh_config.py), so that a
# shorter cut costs no connection.
_SILENT_MS = 2500


def give_up_stalled_connections() -> int:
    """Set the time limit on this process's listening TCP sockets; returns how many there are.

    None where the system has no such limit: then everything works, but later.
    """
    option = getattr(socket, "TCP_USER_TIMEOUT", None)
    if option is None:
        return 0
    found = 0
    for number in _open_sockets():
        # A copy, which this closes: the socket itself is Zenoh's.
        with contextlib.suppress(OSError), socket.socket(fileno=os.dup(number)) as one:
            if one.family in (socket.AF_INET, socket.AF_INET6) and _listens(one):
                one.setsockopt(socket.IPPROTO_TCP, option, _SILENT_MS)
                found += 1
    return found


def _open_sockets() -> list[int]:
    """Descriptors of this process's sockets: a copy of anything else would be left open."""
    numbers = []
    for entry in list(Path("/proc/self/fd").iterdir()):
        with contextlib.suppress(OSError):
            if str(entry.readlink()).startswith("socket:"):
                numbers.append(int(entry.name))
    return numbers


def _listens(one: socket.socket) -> bool:
    return (
        one.type == socket.SOCK_STREAM
        and one.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN) == 1
    )
