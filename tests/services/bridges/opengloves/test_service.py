"""The bridge on a real router, to the helper for Windows over real (POSIX) pipes, and to a terminal
as a serial line.
"""

from __future__ import annotations

import asyncio
import os
import sys

from rhot import topics
from rhot.files.bridge_tables import Bridges, OpenGloves
from rhot.files.config import RigConfig
from services.bridges.opengloves.glove import glove_of, pipe_bytes, serial_line
from services.bridges.service import serve
from testing.sample_hands import random_pose
from testing.source_tree import ROOT

HELPER = ROOT / "deploy" / "windows" / "opengloves-pipe.py"


async def bytes_of(file: int, wanted: bytes) -> None:
    """Reads until these have come; what came before may have been cut."""
    found = b""
    while wanted not in found:
        await asyncio.sleep(0.01)
        try:
            found = (found + os.read(file, 65_536))[-4096:]
        except (BlockingIOError, OSError):
            continue


async def helper(*options: str) -> tuple[asyncio.subprocess.Process, int]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, str(HELPER), "--port", "0", *options, stdout=asyncio.subprocess.PIPE
    )
    line = (await process.stdout.readline()).decode()
    return process, int(line.rpartition(":")[2])


async def test_the_helper_writes_whole_structs_into_the_pipes(running, sending, tmp_path):
    for hand in ("left", "right"):
        os.mkfifo(tmp_path / hand)
    process, port = await helper("--pipes", f"{tmp_path}/")
    config = RigConfig(bridges=Bridges(opengloves=OpenGloves(enabled=True, port=port)))
    try:
        async with running("bridge", serve, config, instance="opengloves") as (service, bus):
            for hand in ("left", "right"):
                pose = random_pose(hand, 1)
                wanted = pipe_bytes(glove_of(pose))
                publisher = bus.publisher(topics.POSE, hand=hand)
                file = os.open(tmp_path / hand, os.O_RDONLY | os.O_NONBLOCK)
                with sending(lambda put=publisher.put, one=pose: put(one)):
                    await bytes_of(file, wanted)
                os.close(file)
            assert service.status == f"sending to 127.0.0.1:{port}"
    finally:
        process.terminate()
        await process.communicate()


async def test_a_serial_line_gets_lines_and_may_come_and_go(running, sending, tmp_path):
    device = tmp_path / "rfcomm0"
    table = OpenGloves(enabled=True, serial_left=str(device))
    config = RigConfig(bridges=Bridges(opengloves=table))
    async with running("bridge", serve, config, instance="opengloves") as (service, bus):
        while "No such file" not in service.status:
            await asyncio.sleep(0.01)
        pose = random_pose("left", 1)
        publisher = bus.publisher(topics.POSE, hand="left")
        for _ in range(2):
            ours, theirs = os.openpty()
            os.set_blocking(ours, False)
            device.unlink(missing_ok=True)
            device.symlink_to(os.ttyname(theirs))
            with sending(lambda: publisher.put(pose)):
                await bytes_of(ours, b"\n" + serial_line(glove_of(pose)))
            assert service.status.startswith(f"sending to {device}")
            os.close(ours)
            os.close(theirs)
            while "waits for" not in service.status:
                await asyncio.sleep(0.01)
