"""The bridge for browsers and every language: the rig's messages as JSON over WebSocket.

Nothing is subscribed to while no client is connected.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from rhot import topics
from rhot.process.service import Service, rhot_version
from rhot.topics import Topic
from services.bridges.screening import hand_is_plausible, object_is_plausible
from services.bridges.websocket.door import Door
from services.bridges.websocket.protocol import frame, hello
from services.bridges.websocket.server import WebServer

log = logging.getLogger("rhot.bridge")

_TABLE = "bridges.websocket"
_PLAUSIBLE: dict[Topic[Any], Callable[[Any], bool]] = {
    topics.POSE: hand_is_plausible,
    topics.OBJECT: object_is_plausible,
}


async def serve(service: Service) -> None:
    """Sends hands, objects and contacts to whoever connects to ws://127.0.0.1:8766."""
    config, table = service.config, service.config.bridges.websocket
    door = Door(table.host, table.token, table.origins, _TABLE)
    said = hello(config, rhot_version(), table.rate_hz)
    server = WebServer(door, frame("hello", said), table.rate_hz)
    async with server.listening(table.host, table.port, _TABLE) as port:
        service.values["port"] = port
        log.info("messages at ws://%s:%d", table.host, port)
        service.ready()
        await feed_clients(service, server)


async def feed_clients(service: Service, server: WebServer) -> None:
    """The rig's messages to all clients, for ever; nothing while there are none."""
    while True:
        _tell(service, server)
        await server.connected.wait()
        async with asyncio.TaskGroup() as tasks:
            following = [
                tasks.create_task(_follow(service, server, topic))
                for topic in (topics.POSE, topics.OBJECT, topics.CONTACTS)
            ]
            while server.connected.is_set():
                _tell(service, server)
                await asyncio.sleep(0.5)
            for task in following:
                task.cancel()


async def _follow(service: Service, server: WebServer, topic: Topic[Any]) -> None:
    subscription = service.bus.latest(topic)
    try:
        async for message in subscription:
            if topic in _PLAUSIBLE and not _PLAUSIBLE[topic](message):
                subscription.stats.rejected += 1
                continue
            names = {field: getattr(message, field) for field in topic.fields}
            told = topic.template.format(**names)
            server.put(told, frame(told, message))
    finally:
        service.bus.close(subscription)


def _tell(service: Service, server: WebServer) -> None:
    service.values["clients"] = server.clients
    service.status = f"{server.clients} connected"
