"""Whether a port of this machine is free, and who has it if not (Linux's /proc/net/tcp)."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterable
from pathlib import Path

from services.cli.rig.listening_sockets import inodes_of, listening_sockets
from services.cli.rig.place import host_and_port


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
    inodes = {one.inode for one in listening_sockets() if one.port == port}
    for process in Path("/proc").glob("[0-9]*") if inodes else ():
        # Processes end meanwhile.
        with contextlib.suppress(OSError):
            if not inodes.isdisjoint(inodes_of(process)):
                return f"{(process / 'comm').read_text().strip()} (process {process.name})"
    return ""
