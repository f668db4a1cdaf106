"""A connection to a program that stops reading."""

from __future__ import annotations

import asyncio
import contextlib

from services.bridges.endpoints.tcp import TcpLink


async def test_who_does_not_read_gets_whole_frames_and_the_newest_later():
    go_on, gone = asyncio.Event(), asyncio.Event()
    frames: list[int] = []

    async def read_late(reader, writer):
        await go_on.wait()
        with contextlib.suppress(asyncio.IncompleteReadError):
            while True:
                frame = await reader.readexactly(10_000)
                assert frame == frame[:4] * 2_500
                frames.append(int.from_bytes(frame[:4]))
        writer.close()
        gone.set()

    server = await asyncio.start_server(read_late, "127.0.0.1", 0, limit=10_000)
    link = TcpLink("127.0.0.1", server.sockets[0].getsockname()[1])
    running = asyncio.create_task(link.run())
    try:
        async with asyncio.timeout(20.0):
            while not link.connected:
                await asyncio.sleep(0.01)
            for number in range(5_000):
                link.send(number.to_bytes(4) * 2_500)
                if number % 100 == 0:
                    await asyncio.sleep(0)
            assert link.dropped > 0
            go_on.set()
            while not frames or frames[-1] < 5_000:
                link.send((5_000).to_bytes(4) * 2_500)
                await asyncio.sleep(0.01)
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        await gone.wait()
        server.close()
        await server.wait_closed()
    assert frames == sorted(frames)
