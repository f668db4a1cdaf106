"""The bridge to Foxglove: a live connection for its app, ws://127.0.0.1:8765.

Foxglove's own server (foxglove-sdk) speaks to the app in threads of its own, and drops the oldest
for who is slow. It knows no password, and whoever reaches it may look: it listens on this machine
alone.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Iterator

import foxglove

from rhot import topics
from rhot.errors import BusError, ConfigError
from rhot.process.service import Service
from services.bridges.endpoints.feed import Feed
from services.bridges.endpoints.object_meshes import object_meshes
from services.bridges.foxglove.channels import Channels
from services.bridges.foxglove.encode import SHAPES_S
from services.bridges.unsent import Unsent

log = logging.getLogger("rhot.bridge")

_LOOPBACK = ("127.0.0.1", "localhost", "::1")
# Messages that wait for one client, of all channels together: two hands and two objects have ten a
# frame. Foxglove's own 1024 would be 3 s of the past.
_BACKLOG = 64


async def serve(service: Service) -> None:
    """Shows the rig's hands and objects in Foxglove."""
    config, table = service.config, service.config.bridges.foxglove
    context = foxglove.Context()
    channels = Channels(config, context, await asyncio.to_thread(object_meshes, config))
    with server(table.host, table.port, context) as port:
        service.values["port"] = port
        service.status = f"Foxglove finds it at ws://{table.host}:{port}"
        log.info("%s", service.status)
        service.ready()
        service.tasks.create_task(_contacts(service, channels))
        unsent, shapes_due_s = Unsent(), 0.0
        async for frame in Feed(service, table.rate_hz):
            hands, objects = unsent.hands(frame), unsent.objects(frame)
            if hands or objects:
                channels.hands(hands, objects)
            if (now_s := time.monotonic()) >= shapes_due_s:
                shapes_due_s = now_s + SHAPES_S
                channels.shapes(list(frame.objects.values()))


async def _contacts(service: Service, channels: Channels) -> None:
    async for contacts in service.bus.latest(topics.CONTACTS):
        channels.message(topics.CONTACTS, contacts)


@contextlib.contextmanager
def server(host: str, port: int, context: foxglove.Context) -> Iterator[int]:
    """Serves for as long as the block lasts; the port, another one for port 0.

    Raises ConfigError for a host beyond this machine, BusError if the address cannot be had.
    """
    if host not in _LOOPBACK:
        raise ConfigError(
            f"[bridges.foxglove] host = {host!r}: Foxglove's protocol has no password, so that it "
            f"is for this machine alone; from another one use `ssh -L {port}:127.0.0.1:{port}`"
        )
    # It logs each client that comes and goes.
    logging.getLogger("foxglove").setLevel(logging.ERROR)
    try:
        running = foxglove.start_server(
            name="rhot", host=host, port=port, context=context, message_backlog_size=_BACKLOG
        )
    except RuntimeError as error:
        raise BusError(
            f"Foxglove's server cannot listen at {host}:{port}: {error}; set another port under "
            "[bridges.foxglove] in rig.toml, 0 for any free one"
        ) from None
    try:
        yield running.port
    finally:
        running.stop()
