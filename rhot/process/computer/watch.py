"""Tells of the computer in health: temperature, throttling, free space.

One service of a host tells, however many run there: the first that takes the host's name among the
abstract sockets, which goes back with its process. Trackers and fusion try, so that every computer
of a rig has one that tells.
"""

from __future__ import annotations

import asyncio
import re
import socket
from pathlib import Path

from rhot.process.computer.readings import faults_of, read_computer, values_of
from rhot.process.service import Service

# Nothing of it changes faster.
_PERIOD_S = 5.0


async def watch_computer(service: Service, root: Path = Path("/")) -> None:
    """Tell for ever, from when no other service of this host and rig does."""
    host = re.sub(r"[^A-Za-z0-9_.-]", "_", socket.gethostname())[:64]
    config = service.config
    folders = (config.calibration_dir, Path(config.folder) / config.recorder.folder)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as token:
        while True:
            if not token.getsockname() and not _taken(token, f"\0rhot-computer-{config.rig.name}"):
                await service.turn(_PERIOD_S)
                continue
            computer = await asyncio.to_thread(read_computer, folders, root)
            service.values.update(values_of(computer))
            standing = [fault.code for fault in service.faults.standing()]
            for code, texts in faults_of(computer, host, standing).items():
                service.faults.replace(code, texts)
            await service.turn(_PERIOD_S)


def _taken(token: socket.socket, name: str) -> bool:
    """Whether the name is ours now."""
    try:
        token.bind(name)
    except OSError:
        return False
    return True
