"""Routers that run on this computer, and where they listen: for a rig.toml with another port.

Read from /proc: nobody is connected to. A process of another user does not show its sockets, and is
not found.
"""

from __future__ import annotations

import contextlib
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

# State of a listening socket in /proc/net/tcp, and how a link to a socket begins.
_LISTENING, _SOCKET = "0A", "socket:["


def router_endpoints(proc: Path = Path("/proc")) -> list[str]:
    """`tcp/HOST:PORT` of every Zenoh router that this user may see."""
    listening = _listening(proc)
    found = {
        address
        for process in _routers(proc)
        for inode in _sockets(process)
        if (address := listening.get(inode)) is not None
    }
    return sorted(f"tcp/{address}" for address in found)


def _routers(proc: Path) -> Iterator[Path]:
    for process in proc.glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
            names = {Path(word).name for word in words[:4]}
            if "zenohd" in names or ("router" in words and {"rhot", "services.cli"} & names):
                yield process


def _sockets(process: Path) -> Iterator[str]:
    with contextlib.suppress(OSError):
        for link in (process / "fd").iterdir():
            with contextlib.suppress(OSError):
                target = str(link.readlink())
                if target.startswith(_SOCKET):
                    yield target[len(_SOCKET) : -1]


def _listening(proc: Path) -> dict[str, str]:
    """Inode of every listening TCP socket -> HOST:PORT."""
    found: dict[str, str] = {}
    for name, family in (("tcp", socket.AF_INET), ("tcp6", socket.AF_INET6)):
        with contextlib.suppress(OSError):
            for line in (proc / "net" / name).read_text().splitlines()[1:]:
                fields = line.split()
                if fields[3] == _LISTENING:
                    found[fields[9]] = _address(fields[1], family)
    return found


def _address(written: str, family: socket.AddressFamily) -> str:
    """HOST:PORT of `0100007F:1D17`: 32-bit words in this machine's order."""
    host, _, port = written.partition(":")
    words = [int(host[k : k + 8], 16) for k in range(0, len(host), 8)]
    name = socket.inet_ntop(family, struct.pack(f"={len(words)}I", *words))
    return f"{f'[{name}]' if ':' in name else name}:{int(port, 16)}"
