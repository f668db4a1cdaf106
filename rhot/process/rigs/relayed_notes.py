"""What the processes of one service tell systemd, as from one: systemd hears only the first."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
from pathlib import Path

from rhot.plain_text import printable
from rhot.process import systemd

# A note is a line or two; systemd takes some kB.
_MAX_NOTE = 4096


class RelayedNotes:
    """A channel for each process, and what has come through it. Nothing where there is no systemd.

    READY as the first says it, the status of all, and the watchdog's food only once every one that
    ever fed it has done so again: one whose loop is stuck has the service started anew.
    """

    def __init__(self, folder: Path, processes: int) -> None:
        """folder: empty, and nobody else's. In the event loop, and to be closed."""
        self._channels: dict[int, socket.socket] = {}
        self._statuses: dict[int, str] = {}
        # Who feeds, and who has since the last time that it was passed on.
        self._feeding: set[int] = set()
        self._fed: set[int] = set()
        if os.environ.get("NOTIFY_SOCKET"):
            for number in range(processes):
                channel = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
                channel.setblocking(False)
                channel.bind(str(folder / str(number)))
                asyncio.get_running_loop().add_reader(channel, self._hear, number, channel)
                self._channels[number] = channel

    def environment(self, number: int) -> dict[str, str]:
        """What a process needs to be heard; none of its own process id, which systemd gave us."""
        if number not in self._channels:
            return {}
        return {"NOTIFY_SOCKET": self._channels[number].getsockname(), "WATCHDOG_PID": ""}

    def forget(self, number: int) -> None:
        """A process has ended: it need not feed any more, and has no status."""
        self._feeding.discard(number)
        self._fed.discard(number)
        self._statuses.pop(number, None)

    def close(self) -> None:
        """Hear nobody any more."""
        for channel in self._channels.values():
            asyncio.get_running_loop().remove_reader(channel)
            channel.close()

    def _hear(self, number: int, channel: socket.socket) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                for line in channel.recv(_MAX_NOTE).decode(errors="replace").splitlines():
                    self._take(number, line)

    def _take(self, number: int, line: str) -> None:
        field, _, value = line.partition("=")
        if field == "WATCHDOG":
            self._feeding.add(number)
            self._fed.add(number)
            if self._fed >= self._feeding:
                self._fed.clear()
                systemd.notify(line)
        elif field == "STATUS":
            self._statuses[number] = printable(value)
            systemd.notify("STATUS=" + "; ".join(self._statuses.values()))
        elif field == "READY":
            systemd.notify(line)
        elif field == "EXTEND_TIMEOUT_USEC":
            systemd.ask_for_time()
