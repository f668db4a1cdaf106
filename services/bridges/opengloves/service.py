"""The bridge to OpenGloves: to the helper that writes its named pipes, and to serial lines."""

from __future__ import annotations

import contextlib

from rhot.hand import HandName
from rhot.process.service import Service
from services.bridges.endpoints.feed import Feed
from services.bridges.endpoints.link import Link
from services.bridges.endpoints.udp import open_udp
from services.bridges.opengloves.glove import HELPER_MARKS, glove_of, pipe_bytes, serial_line


async def serve(service: Service) -> None:
    """Sends hands for ever; a hand that is lost is not sent."""
    table = service.config.bridges.opengloves
    devices: dict[HandName, str] = {"left": table.serial_left, "right": table.serial_right}
    lines: dict[HandName, Link] = {}
    if any(devices.values()):
        # Windows has no termios.
        from services.bridges.endpoints.serial_line import SerialLink

        for hand, device in devices.items():
            if device:
                lines[hand] = line = SerialLink(device, table.baud)
                service.tasks.create_task(line.run())
    with contextlib.closing(await open_udp(table.host, table.port, "bridges.opengloves")) as link:
        service.ready()
        async for frame in Feed(service, table.rate_hz):
            for hand, pose in frame.hands.items():
                glove = glove_of(pose)
                if hand in lines:
                    lines[hand].send(serial_line(glove))
                else:
                    link.send(HELPER_MARKS[hand] + pipe_bytes(glove))
            links: list[Link] = list(lines.values())
            if len(lines) < len(devices):
                links.append(link)
            service.status = "; ".join(one.status for one in links)
            service.values |= {
                "sent": sum(one.sent for one in links),
                "dropped": sum(one.dropped for one in links),
            }
