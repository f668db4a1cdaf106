"""The WebXR page: the rig's hands and objects in a browser, http://127.0.0.1:8767/xr.

A headset's browser shows them in the room, a desktop's with the mouse. Browsers open a headset's
view for pages of the same machine, and for https.
"""

from __future__ import annotations

import asyncio
import logging
import ssl
from pathlib import Path

from rhot.errors import ConfigError
from rhot.files.bridge_tables import WebXr
from rhot.files.config import RigConfig
from rhot.process.service import Service, rhot_version
from services.bridges.endpoints.object_meshes import object_meshes
from services.bridges.placement import placement_of
from services.bridges.websocket.door import Door
from services.bridges.websocket.protocol import frame, hello
from services.bridges.websocket.server import WebServer
from services.bridges.websocket.service import feed_clients
from services.bridges.webxr import page

log = logging.getLogger("rhot.bridge")

_TABLE = "bridges.webxr"


async def serve(service: Service) -> None:
    """Serves the page and its messages."""
    config, table = service.config, service.config.bridges.webxr
    door = Door(table.host, table.token, (), _TABLE)
    tls = tls_context(config, table)
    meshes = await asyncio.to_thread(object_meshes, config)
    said = hello(
        config,
        rhot_version(),
        table.rate_hz,
        meshes={name: page.mesh_path(name) for name in meshes},
        floor_from_rig=page.floor_from_rig(placement_of(table)),
    )
    files = await asyncio.to_thread(page.files, meshes)
    server = WebServer(door, frame("hello", said), table.rate_hz, files, page.LIVE)
    async with server.listening(table.host, table.port, _TABLE, tls) as port:
        service.values["port"] = port
        scheme = "http" if tls is None else "https"
        log.info("page at %s://%s:%d%s", scheme, table.host, port, page.PAGE)
        service.ready()
        await feed_clients(service, server)


def tls_context(config: RigConfig, table: WebXr) -> ssl.SSLContext | None:
    """https with the certificate of rig.toml; None without one.

    Raises ConfigError if the files cannot be used.
    """
    if not table.certificate and not table.key:
        return None
    if not table.certificate or not table.key:
        raise ConfigError(f"[{_TABLE}] has certificate or key alone; https needs both")
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    certificate, key = (Path(config.folder) / name for name in (table.certificate, table.key))
    try:
        context.load_cert_chain(certificate, key)
    except (OSError, ssl.SSLError) as error:
        raise ConfigError(
            f"[{_TABLE}] certificate {certificate} and key {key} cannot be used: {error}; "
            "`rhot pki` makes a pair for the master"
        ) from None
    return context
