"""The service on a real loopback router: the master's duties, and markers in, points out."""

from __future__ import annotations

import asyncio
import contextlib

import msgspec
import pytest

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.messages import Session
from rhot.process.service import Service
from services.fusion.service import serve
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

RIG = "bench"
DEADLINE_S = 60.0


@pytest.fixture
def config(tmp_path) -> RigConfig:
    """The synthetic rig with its calibration on disk."""
    setup = SyntheticRig()
    setup.save_calibration(tmp_path / "calibration")
    return msgspec.structs.replace(setup.config(), folder=str(tmp_path))


@contextlib.asynccontextmanager
async def running(config, bus):
    """The service in its own TaskGroup, as rhot.process.lifecycle runs it, cancelled at the end."""
    services: asyncio.Queue[Service] = asyncio.Queue()

    async def live() -> None:
        async with asyncio.TaskGroup() as tasks:
            service = Service("fusion", "main", config, bus, tasks)
            services.put_nowait(service)
            await serve(service)

    task = asyncio.create_task(live())
    yield await services.get()
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


async def test_without_calibration_it_says_what_makes_it(router, tmp_path):
    config = msgspec.structs.replace(SyntheticRig().config(), folder=str(tmp_path))
    async with open_bus(RIG, [router]) as bus, asyncio.TaskGroup() as tasks:
        with pytest.raises(CalibrationError, match="rhot calibrate"):
            await serve(Service("fusion", "main", config, bus, tasks))


async def test_leads_the_rig_and_turns_markers_into_points(router, config):
    async with (
        asyncio.timeout(DEADLINE_S),
        open_bus(RIG, [router]) as bus,
        open_bus(RIG, [router]) as client,
    ):
        heard, points = client.every(topics.SESSION, 8), client.every(topics.POINTS, 64)
        async with running(config, bus) as service:
            assert (await anext(aiter(heard))).running
            answers = await client.get(topics.SESSION, DEADLINE_S)
            assert answers[0].running
            while not (exchanges := await client.echoes(clock.now_ns)):
                pass
            (exchange,) = exchanges
            asked_ns, master_ns, answered_ns = exchange.stamps
            assert asked_ns <= master_ns <= answered_ns
            assert exchange.echo.session == service.bus.session
            await feed(client, points)
            await stop(client)
            assert service.state == "running"
            await one_unknown_camera(client, service)


async def feed(client, points):
    """Frames until points arrive that are where the hand is."""
    publishers = {
        name: client.publisher(topics.MARKERS, camera=name) for name in SyntheticRig().names
    }
    path, setup = MovingHand(), SyntheticRig(clock_error_s=0.0, loss=0.0)
    while not all(publisher.wanted for publisher in publishers.values()):
        await asyncio.sleep(0.01)

    async def play():
        # As long as it takes, and not all at once: what the network cannot take is dropped by
        # design.
        for frame in frames(setup, path, 60.0):
            publishers[frame.camera].put(frame)
            await asyncio.sleep(0.005)

    playing = asyncio.create_task(play())
    async for message in points:
        if len(message.points) == 6 and message.stamp_ns > START_NS + 8 * 10**8:
            assert message.hand == "right"
            assert 0.4 < message.points[0].position_m[2] < 1.0
            break
    playing.cancel()


async def stop(client):
    """Whoever broadcasts a stop, the master tells it to those who ask."""
    sessions = client.publisher(topics.SESSION)
    while any(answer.running for answer in await client.get(topics.SESSION, DEADLINE_S)):
        # Again: a busy machine may drop one.
        sessions.put(Session(running=False, start_ns=clock.now_ns()))
        await asyncio.sleep(0.05)


async def one_unknown_camera(client, service):
    """A camera that is not in the rig is named, and nothing ends."""
    stranger = client.publisher(topics.MARKERS, camera="door")
    frame = msgspec.structs.replace(frames(SyntheticRig(), MovingHand(), 0.1)[0], camera="door")
    while "door" not in service.last_error:
        stranger.put(frame)
        await asyncio.sleep(0.01)
    assert "does not name" in service.last_error
