"""The bridge to programs with VMC: a bundle for each frame, to one UDP port."""

from __future__ import annotations

import contextlib

from rhot.process.service import Service
from services.bridges.endpoints.feed import Feed
from services.bridges.endpoints.udp import open_udp
from services.bridges.placement import placement_of
from services.bridges.vmc.osc import bundle


async def serve(service: Service) -> None:
    """Sends frames for ever; who does not listen misses them."""
    table = service.config.bridges.vmc
    placement = placement_of(table)
    with contextlib.closing(await open_udp(table.host, table.port, "bridges.vmc")) as link:
        service.ready()
        async for frame in Feed(service, table.rate_hz):
            link.send(bundle(frame, table, placement))
            service.status = link.status
            service.values |= {"sent": link.sent, "dropped": link.dropped, "away": link.refused}
