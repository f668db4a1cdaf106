"""The bridge to Monado's remote driver: a packet for each frame, over TCP."""

from __future__ import annotations

from rhot.process.service import Service
from services.bridges.endpoints.feed import Feed
from services.bridges.endpoints.tcp import TcpLink
from services.bridges.monado.packet import packet
from services.bridges.placement import placement_of


async def serve(service: Service) -> None:
    """Sends frames for ever; Monado may come and go."""
    table = service.config.bridges.monado
    placement = placement_of(table)
    link = TcpLink(table.host, table.port)
    service.tasks.create_task(link.run())
    service.ready()
    async for frame in Feed(service, table.rate_hz):
        link.send(packet(frame, table, placement))
        service.status = link.status
        service.values |= {"sent": link.sent, "dropped": link.dropped, "away": not link.connected}
