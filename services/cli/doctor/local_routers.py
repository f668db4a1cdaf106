"""Routers that run on this computer, and where they listen: for a rig.toml with another port.

Read from /proc: nobody is connected to. A process of another user does not show its sockets, and is
not found.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from services.cli.rig.listening_sockets import ListeningSocket, inodes_of, listening_sockets


def router_endpoints(proc: Path = Path("/proc")) -> list[str]:
    """`tcp/HOST:PORT` of every Zenoh router that this user may see."""
    listening = {one.inode: one for one in listening_sockets(proc)}
    found = {
        _endpoint(listening[inode])
        for process in _routers(proc)
        for inode in inodes_of(process)
        if inode in listening
    }
    return sorted(found)


def _routers(proc: Path) -> Iterator[Path]:
    for process in proc.glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
            names = {Path(word).name for word in words[:4]}
            if "zenohd" in names or ("router" in words and {"rhot", "services.cli"} & names):
                yield process


def _endpoint(one: ListeningSocket) -> str:
    host = f"[{one.host}]" if ":" in one.host else one.host
    return f"tcp/{host}:{one.port}"
