"""Whether a port of this machine is free, and who has it if not (Linux's /proc/net/tcp)."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterable, Iterator
from pathlib import Path

from services.cli.rig.place import host_and_port

# State of a listening socket in /proc/net/tcp.
_LISTENING = "0A"


def taken_ports(endpoints: Iterable[str]) -> dict[int, str]:
    """Ports of these endpoints that somebody listens at already, and who (see owner_of)."""
    taken = {}
    for endpoint in endpoints:
        host, port = host_and_port(endpoint)
        if port.isdecimal() and 0 < int(port) < 65536 and not is_free(host, int(port)):
            taken[int(port)] = owner_of(int(port))
    return taken


def is_free(host: str, port: int) -> bool:
    """Whether somebody could listen there now."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        # As routers do: the end of an earlier connection is no obstacle, a listener is.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError:
            return False
        return True


def owner_of(port: int) -> str:
    """The process that listens at a port, as `python3 (process 123)`.

    "" if there is none, or it is another user's and so cannot be seen.
    """
    inodes = {f"socket:[{inode}]" for inode in _listeners(port)}
    for process in Path("/proc").glob("[0-9]*") if inodes else ():
        # Processes end, and those of other users do not show their files.
        with contextlib.suppress(OSError):
            if any(str(file.readlink()) in inodes for file in (process / "fd").iterdir()):
                return f"{(process / 'comm').read_text().strip()} (process {process.name})"
    return ""


def _listeners(port: int) -> Iterator[str]:
    """Inodes of the sockets that listen at a port."""
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with contextlib.suppress(OSError):
            for line in Path(table).read_text().splitlines()[1:]:
                fields = line.split()
                if fields[3] == _LISTENING and int(fields[1].rpartition(":")[2], 16) == port:
                    yield fields[9]
