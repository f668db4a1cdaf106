"""Visitors of the live page: a websocket that reads what a browser would, and a real Chromium."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterator

import msgspec
import viser
from viser import _messages
from websockets.asyncio.client import connect

# A picture has the skin of at least one hand; texts are shorter.
_PICTURE_BYTES = 10_000


class Visitor:
    """A browser as far as viser's server can see; reading can be slowed and stopped."""

    def __init__(self) -> None:
        self.pictures = self.received_bytes = 0

    async def look(self, port: int, wait_s: float | None = 0.0) -> None:
        """Stay; wait_s after each message, None: never read."""
        async with connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            max_size=None,
            compression=None,
            # Who does not read does not answer either; a browser that is stopped is no different.
            ping_interval=None,
        ) as connection:
            at = _messages.ViewerCameraMessage(
                (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, 0.1, 10.0, 1280, 800,
                (0.0, 0.0, 1.0), (0.0, -1.0, 0.0),
            )  # fmt: skip
            await connection.send(msgspec.msgpack.encode(at.as_serializable_dict()))
            if wait_s is None:
                await asyncio.Event().wait()
            async for message in connection:
                self.pictures += len(message) > _PICTURE_BYTES
                self.received_bytes += len(message)
                await asyncio.sleep(wait_s or 0.0)


@contextlib.contextmanager
def chromium(port: int) -> Iterator[int]:
    """A headless Chromium that looks at the page: the id of its process group."""
    flags = ("--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
    with tempfile.TemporaryDirectory() as profile:
        quiet = ("--disable-background-networking", "--no-first-run", f"--user-data-dir={profile}")
        process = subprocess.Popen(
            ["chromium", *flags, *quiet, "--remote-debugging-port=0", f"http://127.0.0.1:{port}"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            yield process.pid
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
