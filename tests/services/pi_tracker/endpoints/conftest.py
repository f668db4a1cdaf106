"""A tracker on a real router, with a camera that shows two painted tips."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

from rhot import topics
from rhot.client import RigClient
from rhot.files.calibration import save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable, RigTable
from rhot.messages import Session
from rhot.messages.simulator import SimFrame
from services.pi_tracker.service import serve

SIZE = (240, 160)


@pytest.fixture
def config(tmp_path, colors) -> RigConfig:
    """A rig of one simulated camera that looks for green and blue, calibrated."""
    save(tmp_path / "calibration" / "left.colors.json", colors)
    return RigConfig(
        rig=RigTable(name="desk"),
        camera=[CameraTable(name="left", source="simulator", size_px=SIZE)],
        hand={"right": HandTable(markers={"index_tip": "green", "thumb_tip": "blue"})},
        folder=str(tmp_path),
    )


@pytest.fixture
def picture(studio, tip):
    """The frame the camera shows, and where the tips are."""
    tips = [
        tip("green", 70.0, 80.0, width_px=14.0, length_px=16.0),
        tip("blue", 130.0, 70.0, width_px=14.0, length_px=16.0),
    ]
    return studio.frame(tips, size_px=SIZE)


@pytest.fixture
def tracking(running, picture):
    """`async with tracking(config) as (service, client)`: a running tracker with frames, and a bus
    to reach it by.
    """

    @contextlib.asynccontextmanager
    async def run(config):
        async with running("pi_tracker", serve, config, instance="left") as (service, bus):
            bus.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
            film = asyncio.ensure_future(_film(bus, picture[0]))
            beat = asyncio.ensure_future(service.beat())
            try:
                yield service, RigClient(bus)
            finally:
                beat.cancel()
                film.cancel()

    return run


async def _film(bus, frame):
    publisher = bus.publisher(topics.SIM_FRAME, camera="left")
    for seq in range(10_000):
        told = SimFrame(
            camera="left",
            seq=seq,
            stamp_ns=10**18 + seq * 20_000_000,
            row_time_ns=1e4,
            size_px=SIZE,
            clock_skew_ns=0,
        )
        # No two pictures of a camera are the same.
        frame.image[-1, -1] = seq % 256
        publisher.put_bytes(frame.image.tobytes(), told)
        await asyncio.sleep(0.02)


@pytest.fixture
def seen():
    """Wait until the newest MarkerFrame shows exactly these colours."""

    async def wait(client, *colors):
        markers = client.markers("left")
        async for frame in markers:
            if sorted(marker.color for marker in frame.markers) == sorted(colors):
                client.bus.close(markers)
                return

    return wait
