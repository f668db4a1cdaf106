"""The TCP sockets of this computer that listen, as Linux lists them in /proc/net/tcp."""

from __future__ import annotations

import contextlib
import socket
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

# State of a listening socket in /proc/net/tcp, and how a link to a socket begins.
_LISTENING, _SOCKET = "0A", "socket:["


class ListeningSocket(NamedTuple):
    """Where it listens, and its inode, which tells whose it is."""

    host: str
    port: int
    inode: str


def listening_sockets(proc: Path = Path("/proc")) -> list[ListeningSocket]:
    """Every listening TCP socket; none where the system has no such list."""
    found = []
    for name, family in (("tcp", socket.AF_INET), ("tcp6", socket.AF_INET6)):
        with contextlib.suppress(OSError):
            for line in (proc / "net" / name).read_text().splitlines()[1:]:
                fields = line.split()
                if fields[3] == _LISTENING:
                    found.append(ListeningSocket(*_address(fields[1], family), fields[9]))
    return found


def inodes_of(process: Path) -> Iterator[str]:
    """Inodes of the sockets that a process (its folder in /proc) has open.

    None for a process that has ended, or that is another user's.
    """
    with contextlib.suppress(OSError):
        for link in (process / "fd").iterdir():
            with contextlib.suppress(OSError):
                target = str(link.readlink())
                if target.startswith(_SOCKET):
                    yield target[len(_SOCKET) : -1]


def _address(written: str, family: socket.AddressFamily) -> tuple[str, int]:
    """Host and port of `0100007F:1D17`: 32-bit words in this machine's order."""
    host, _, port = written.partition(":")
    words = [int(host[k : k + 8], 16) for k in range(0, len(host), 8)]
    return socket.inet_ntop(family, struct.pack(f"={len(words)}I", *words)), int(port, 16)
