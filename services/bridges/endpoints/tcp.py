"""A connection to another program that comes and goes: kept up, and never waited for."""

from __future__ import annotations

import asyncio
import contextlib
import socket

# A program that is started is found within this time.
_RETRY_S = 0.5
# A computer that has vanished without a word is given up after this time, in ms.
_SILENCE_MS = 10_000
# Kept in the system for a program that does not read; the rest is dropped here. Less than the
# least that Linux takes, which is 2304 bytes and doubled.
_SEND_BUFFER = 2048


class TcpLink:
    """Sends whole frames over a connection that `run` opens again and again.

    While a frame is still on its way the next ones are dropped, not queued: what goes out is the
    newest.
    """

    def __init__(self, host: str, port: int) -> None:
        self._host, self._port = host, port
        self._where = f"{host}:{port}"
        self._writer: asyncio.StreamWriter | None = None
        self._why = "not connected yet"
        self.sent = 0
        self.dropped = 0

    @property
    def connected(self) -> bool:
        """Whether the program is there."""
        return self._writer is not None

    @property
    def status(self) -> str:
        """For people."""
        if self.connected:
            return f"connected to {self._where}"
        return f"waits for a program at {self._where} ({self._why})"

    def send(self, frame: bytes) -> None:
        """Send a frame, or drop it."""
        writer = self._writer
        if writer is None or writer.transport.get_write_buffer_size():
            self.dropped += 1
            return
        writer.write(frame)
        self.sent += 1

    async def run(self) -> None:
        """Connect, and again whenever the connection ends; for ever."""
        while True:
            try:
                async with asyncio.timeout(_SILENCE_MS * 1e-3):
                    reader, writer = await asyncio.open_connection(self._host, self._port)
            except (OSError, TimeoutError) as error:
                self._why = getattr(error, "strerror", None) or "no answer"
            else:
                await self._follow(reader, writer)
            await asyncio.sleep(_RETRY_S)

    async def _follow(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Until the other side ends the connection; what it says is of no use."""
        _tune(writer.get_extra_info("socket"))
        self._writer = writer
        try:
            while await reader.read(65_536):
                pass
            self._why = "it has closed the connection"
        except OSError as error:
            self._why = error.strerror or str(error)
        finally:
            self._writer = None
            # What a program has not read is of no use any more.
            writer.transport.abort()
            with contextlib.suppress(OSError):
                await writer.wait_closed()


def _tune(connection: socket.socket) -> None:
    """Frames leave at once, and do not pile up in the system."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _SILENCE_MS)
