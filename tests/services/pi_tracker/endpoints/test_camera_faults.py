"""A tracker's faults as others see them: in its health, on a real router, begun and ended."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket

import msgspec
import numpy as np
import pytest

from rhot import topics
from rhot.files.rig_tables import CameraTable
from rhot.messages import ClockEcho, Session
from rhot.messages.simulator import SimFrame
from services.pi_tracker.service import serve

SIZE = (240, 160)
# What rig.toml says; the camera is three times as fast, and well on a busy machine, too.
FPS = 10.0
# Faults begin and end in tenths of seconds instead of seconds; how long they take in use is for
# tests/services/pi_tracker/monitors/.
QUICK = {
    "services.pi_tracker.endpoints.camera_faults._PATIENCE_S": 0.5,
    "services.pi_tracker.endpoints.camera_faults._PERIOD_S": 0.1,
    "services.pi_tracker.monitors.frame_rate.WINDOW_S": 1.0,
    "services.pi_tracker.monitors.picture_content._PERIOD_NS": 200_000_000,
    "services.pi_tracker.monitors.repeated_picture._FROZEN_NS": 400_000_000,
    "rhot.process.service._BEAT_S": 0.1,
}


class Camera:
    """A simulated camera at 30 Hz that can be told to go wrong."""

    def __init__(self, bus, frame):
        self.frozen = self.covered = False
        self.hz = 30.0
        self._publisher = bus.publisher(topics.SIM_FRAME, camera="left")
        self._image = frame.image

    async def run(self):
        rng = np.random.default_rng(1)
        black = np.clip(rng.normal(17.0, 2.0, self._image.shape), 16, 255).astype(np.uint8)
        black[SIZE[1] :] = 128
        for seq in range(100_000):
            image = black if self.covered else self._image
            if not self.frozen:
                image[-1, -1] = seq % 256
            stamp_ns = 10**18 + round(seq * 1e9 / 30.0)
            told = SimFrame(
                camera="left",
                seq=seq,
                stamp_ns=stamp_ns,
                row_time_ns=1e4,
                size_px=SIZE,
                clock_skew_ns=0,
            )
            self._publisher.put_bytes(image.tobytes(), told)
            await asyncio.sleep(1.0 / self.hz)


class Master:
    """Answers for session and clock, as fusion does."""

    def __init__(self, bus):
        self.session = Session(running=True, start_ns=1)
        self.publisher = bus.publisher(topics.SESSION)
        bus.answer(topics.SESSION, lambda: self.session)
        bus.answer(topics.CLOCK, lambda: ClockEcho(master_ns=10**18))

    def say(self, *, running):
        self.session = Session(running=running, start_ns=1)
        self.publisher.put(self.session)


@pytest.fixture
async def watched(running, config, picture, monkeypatch, tmp_path):
    """`async with watched() as (camera, until, bus)`: a tracker that is watched by its health.

    until(*codes) waits until exactly these faults stand; what health says then.
    """
    for name, value in QUICK.items():
        monkeypatch.setattr(name, value)
    camera = CameraTable(name="left", source="simulator", size_px=SIZE, fps=FPS)
    config = msgspec.structs.replace(config, camera=[camera])

    @contextlib.asynccontextmanager
    async def run():
        async with running("pi_tracker", serve, config, instance="left") as (service, bus):
            camera = Camera(bus, picture[0])
            tasks = [asyncio.ensure_future(one) for one in (camera.run(), service.beat())]
            healths = bus.latest(topics.HEALTH, service="pi_tracker", instance="left")

            async def until(*codes):
                while True:
                    health = await anext(healths)
                    # What the machine is too slow for, or short of, is none of this.
                    told = {fault.code: fault for fault in health.faults}
                    other = {"stream_slow", "disk_low", "computer_hot", "camera_slow"} - set(codes)
                    if set(told) - other == set(codes):
                        return health, told

            try:
                yield camera, until, bus
            finally:
                for task in tasks:
                    task.cancel()

    return run


async def test_a_camera_without_fusion_says_what_it_waits_for(watched):
    async with watched() as (_, until, bus):
        _, told = await until("session_stopped")
        assert "is fusion running?" in told["session_stopped"].text
        master = Master(bus)
        await until()
        master.say(running=False)
        health, told = await until("session_stopped")
        assert "the session is stopped" in told["session_stopped"].text
        assert health.state == "waiting"
        master.say(running=True)
        await until()


async def test_frozen_pictures_are_told_and_never_measured(watched):
    async with watched() as (camera, until, bus):
        Master(bus)
        await until()
        markers = bus.every(topics.MARKERS, 64, camera="left")
        await anext(markers)
        camera.frozen = True
        health, told = await until("camera_frozen")
        assert "the same picture for" in told["camera_frozen"].text
        assert health.values["repeated_frames"] > 3
        # What was on its way is over by now; from here on no frame is measured.
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(0.5):
                while True:
                    await anext(markers)
        # (A timeout ends the iteration's wait, not the subscription.)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.5):
                await anext(markers)
        camera.frozen = False
        assert (await anext(markers)).markers
        await until()


async def test_a_covered_camera_is_dark_until_it_is_uncovered(watched):
    async with watched() as (camera, until, bus):
        Master(bus)
        await until()
        camera.covered = True
        _, told = await until("camera_dark")
        assert told["camera_dark"].severity == "error"
        camera.covered = False
        await until()


async def test_a_slow_camera(watched):
    async with watched() as (camera, until, bus):
        Master(bus)
        await until()
        camera.hz = 4.0
        _, told = await until("camera_slow")
        assert "pictures a second of 10" in told["camera_slow"].text
        camera.hz = 60.0
        while "camera_slow" in told:
            _, told = await until()


async def test_a_master_that_answers_no_clock(watched, monkeypatch):
    async with watched() as (_, until, bus):
        bus.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
        _, told = await until("clock_unknown")
        assert "never been compared" in told["clock_unknown"].text
        bus.answer(topics.CLOCK, lambda: ClockEcho(master_ns=10**18))
        await until()


async def test_systemd_is_told_what_it_does_in_words(watched, monkeypatch, tmp_path):
    address = f"{tmp_path}/notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(address)
        systemd.setblocking(False)
        monkeypatch.setitem(os.environ, "NOTIFY_SOCKET", address)
        async with watched() as (_, _until, bus):

            async def told(words):
                loop = asyncio.get_running_loop()
                while words not in (text := (await loop.sock_recv(systemd, 4096)).decode()):
                    pass
                return text

            await told("STATUS=waiting for fusion")
            master = Master(bus)
            await told("Hz, 2 of 2 markers")
            master.say(running=False)
            await told("STATUS=waiting: session stopped")
