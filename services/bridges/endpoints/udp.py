"""Datagrams to another program; whether it listens is noticed where the system tells it."""

from __future__ import annotations

import asyncio
import socket

from rhot.errors import BusError


class UdpLink:
    """Sends without ever waiting: what the system does not take at once is dropped and counted."""

    def __init__(self, sender: socket.socket, where: str) -> None:
        self._socket = sender
        self._where = where
        self.sent = 0
        self.dropped = 0
        # On this machine the system tells that nobody listens at a port; from others nothing comes
        # back, and nobody knows.
        self.refused = False

    def send(self, datagram: bytes) -> None:
        """Send one datagram, or drop it."""
        try:
            self._socket.send(datagram)
        except ConnectionRefusedError:
            # Of the datagram before; this one was not sent, and the next one asks again.
            self.refused = True
            self.dropped += 1
        except OSError:
            # Full, or the network is away: the next one may go.
            self.dropped += 1
        else:
            self.refused = False
            self.sent += 1

    @property
    def status(self) -> str:
        """For people."""
        return f"nobody listens at {self._where}" if self.refused else f"sending to {self._where}"

    def close(self) -> None:
        """End it."""
        self._socket.close()


async def open_udp(host: str, port: int, table: str) -> UdpLink:
    """A link to that host, a name or an address.

    table is the name of its table in rig.toml. Raises BusError if there is no such host.
    """
    loop = asyncio.get_running_loop()
    try:
        found = await loop.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
        family, kind, protocol, _, address = found[0]
        sender = socket.socket(family, kind, protocol)
        sender.setblocking(False)
        sender.connect(address)
    except OSError as error:
        raise BusError(
            f"cannot send to {host}:{port}: {error.strerror or error}; set another host under "
            f"[{table}] in rig.toml"
        ) from None
    return UdpLink(sender, f"{host}:{port}")
