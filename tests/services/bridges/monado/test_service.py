"""The bridge on a real router and a real TCP server, which comes and goes as Monado does."""

from __future__ import annotations

import asyncio
import contextlib

from rhot import topics
from rhot.files.bridge_tables import Bridges, Monado
from rhot.files.config import RigConfig
from services.bridges.monado.packet import HEADER, SIZE
from services.bridges.service import serve
from testing.sample_hands import random_pose

# Of the left hand, in a packet.
ACTIVE = 136 + 105


@contextlib.asynccontextmanager
async def monado(port: int = 0):
    """(port, packets): as r_hub.c, it tells its own state first, and reads whole packets."""
    packets: asyncio.Queue[bytes] = asyncio.Queue()
    writers = []

    async def talk(reader, writer):
        writers.append(writer)
        writer.write(bytes(2 * SIZE))
        with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
            while True:
                packets.put_nowait(await reader.readexactly(SIZE))

    server = await asyncio.start_server(talk, "127.0.0.1", port)
    try:
        yield server.sockets[0].getsockname()[1], packets
    finally:
        server.close()
        for writer in writers:
            writer.close()
        await server.wait_closed()


async def test_monado_gets_hands_and_may_come_and_go(running, sending):
    async with monado() as (port, _):
        pass
    config = RigConfig(bridges=Bridges(monado=Monado(enabled=True, port=port)))
    async with running("bridge", serve, config, instance="monado") as (service, bus):
        while not service.status.startswith(f"waits for a program at 127.0.0.1:{port} (Connect"):
            await asyncio.sleep(0.01)
        publisher, pose = bus.publisher(topics.POSE, hand="left"), random_pose("left", 1)
        for _ in range(2):
            async with monado(port) as (_, packets):
                with sending(lambda: publisher.put(pose)):
                    while not (packet := await packets.get())[ACTIVE]:
                        pass
                assert packet.startswith(HEADER)
                assert service.status == f"connected to 127.0.0.1:{port}"
                while (await packets.get())[ACTIVE]:
                    pass
            while "closed the connection" not in service.status:
                await asyncio.sleep(0.01)
