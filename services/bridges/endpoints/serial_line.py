"""A serial line to another program (a COM port's other end, Bluetooth); POSIX only."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import os
import struct
import termios
import tty

# A line that is plugged in or paired is found within this time.
_RETRY_S = 0.5


class SerialLink:
    """Sends whole lines, and drops those that come while one is still on its way."""

    def __init__(self, device: str, baud: int) -> None:
        self._device, self._baud = device, baud
        self._file: int | None = None
        self._rest = b""
        self._why = "not opened yet"
        self.sent = 0
        self.dropped = 0

    @property
    def connected(self) -> bool:
        """Whether the device is there."""
        return self._file is not None

    @property
    def status(self) -> str:
        """For people."""
        if self.connected:
            return f"sending to {self._device}"
        return f"waits for {self._device} ({self._why})"

    def send(self, line: bytes) -> None:
        """Send a line, or drop it; the rest of one that was cut goes first."""
        if self._file is None:
            self.dropped += 1
            return
        try:
            if self._rest:
                self._rest = self._rest[os.write(self._file, self._rest) :]
            if self._rest or _waiting(self._file):
                self.dropped += 1
                return
            self._rest = line[os.write(self._file, line) :]
            self.sent += 1
        except BlockingIOError:
            self.dropped += 1
        except OSError as error:
            self._end(error)

    async def run(self) -> None:
        """Open the device, and again whenever it was gone; for ever."""
        loop = asyncio.get_running_loop()
        try:
            while True:
                if self._file is None:
                    try:
                        self._file = _opened(self._device, self._baud)
                        loop.add_reader(self._file, self._discard)
                    except (OSError, termios.error) as error:
                        self._why = os.strerror(error.args[0]) if error.args else str(error)
                await asyncio.sleep(_RETRY_S)
        finally:
            self._end(None)

    def _discard(self) -> None:
        """What the program says (force feedback) is of no use, but must not pile up."""
        with contextlib.suppress(BlockingIOError):
            try:
                if self._file is not None and not os.read(self._file, 4096):
                    self._end(None)
            except BlockingIOError:
                raise
            except OSError as error:
                self._end(error)

    def _end(self, error: OSError | None) -> None:
        if self._file is None:
            return
        self._why = (error.strerror or str(error)) if error else "it was closed"
        asyncio.get_running_loop().remove_reader(self._file)
        with contextlib.suppress(OSError):
            os.close(self._file)
        self._file, self._rest = None, b""


def _opened(device: str, baud: int) -> int:
    file = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        tty.setraw(file)
        mode = termios.tcgetattr(file)
        mode[4] = mode[5] = getattr(termios, f"B{baud}")
        termios.tcsetattr(file, termios.TCSANOW, mode)
    except BaseException:
        os.close(file)
        raise
    return file


def _waiting(file: int) -> int:
    """Bytes that the system has not sent yet."""
    answer = fcntl.ioctl(file, termios.TIOCOUTQ, struct.pack("i", 0))
    return int(struct.unpack("i", answer)[0])
