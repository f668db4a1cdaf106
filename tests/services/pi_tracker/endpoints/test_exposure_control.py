"""Exposure over the bus."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

from rhot import topics
from rhot.client import RigClient
from rhot.errors import RefusedError
from rhot.files.calibration import Exposure, load_exposure, save
from rhot.messages.camera import ExposureControl
from services.pi_tracker.endpoints.exposure_control import ExposureEndpoint
from services.pi_tracker.sources.controls import Controls


class Camera:
    """The reader's side: obeys, and reports what automatics find after a while."""

    def __init__(self, controls, finds=None):
        self.controls = controls
        self.got = []
        self._finds = finds

    async def run(self):
        images = 0
        while True:
            wanted = self.controls.take()
            if wanted is not None:
                self.got.append(wanted.exposure)
                images = 0
            if self.controls.watched and self._finds is not None:
                images += 1
                self.controls.reported = self._finds(images)
            await asyncio.sleep(0.01)


@pytest.fixture
def exposing(running, config):
    """`async with exposing(camera) as client`: the exposure's part of the tracker, with a camera in
    this loop.
    """

    @contextlib.asynccontextmanager
    async def run(camera):
        async def serve(service):
            part = ExposureEndpoint(service)
            part.attach(camera.controls if camera else None)
            service.ready()
            await part.follow()

        async with running("pi_tracker", serve, config, instance="left") as (service, bus):
            client = RigClient(bus)
            while not await bus.get(topics.EXPOSURE, 0.2, camera="left"):
                await asyncio.sleep(0.01)
            film = asyncio.ensure_future(camera.run()) if camera else None
            yield service, client
            if film:
                film.cancel()

    return run


async def test_values_set_by_hand_hold_and_are_written(exposing, tmp_path):
    camera = Camera(Controls())
    async with exposing(camera) as (_, client):
        before = await client.exposure("left")
        assert before.mode == "auto"
        assert "not calibrated" in before.note
        wanted = ExposureControl(exposure_us=6000.0, gain=2.0, red_gain=1.5, blue_gain=1.7)
        now = await client.set_exposure("left", wanted)
        assert (now.mode, now.exposure_us, now.gain) == ("fixed", 6000.0, 2.0)
        saved = load_exposure(tmp_path / "calibration", "left")
        assert (saved.exposure_us, saved.red_gain, saved.blue_gain) == (6000.0, 1.5, 1.7)
        assert saved.date
        assert saved.inputs["how"] == "by hand"
        while len(camera.got) < 1:
            await asyncio.sleep(0.01)
        # One value alone leaves the others.
        now = await client.set_exposure("left", ExposureControl(gain=3.0))
        assert (now.exposure_us, now.gain, now.red_gain) == (6000.0, 3.0, 1.5)
        while len(camera.got) < 2:
            await asyncio.sleep(0.01)
        assert [one.gain for one in camera.got] == [2.0, 3.0]


async def test_automatics_run_once_and_are_frozen(exposing, tmp_path):
    def finds(images):
        return Exposure(
            exposure_us=max(9000.0, 20_000.0 - 1000.0 * images),
            gain=1.5,
            red_gain=1.8,
            blue_gain=1.2,
        )

    camera = Camera(Controls(), finds)
    async with exposing(camera) as (_, client):
        now = await client.set_exposure("left", ExposureControl(mode="auto"))
        assert (now.mode, now.exposure_us, now.red_gain) == ("fixed", 9000.0, 1.8)
        assert load_exposure(tmp_path / "calibration", "left").exposure_us == 9000.0
        assert camera.got[0] is None
        while len(camera.got) < 2:
            await asyncio.sleep(0.01)
        assert camera.got[1].exposure_us == 9000.0


async def test_automatics_that_hunt_are_frozen_with_a_note(exposing, monkeypatch):
    monkeypatch.setattr("services.pi_tracker.endpoints.exposure_control._SETTLE_TIMEOUT_S", 1.5)
    camera = Camera(
        Controls(),
        lambda images: Exposure(
            exposure_us=5000.0 + 500.0 * (images % 7), gain=1.0, red_gain=1.0, blue_gain=1.0
        ),
    )
    async with exposing(camera) as (_, client):
        now = await client.set_exposure("left", ExposureControl(mode="auto"))
        assert now.mode == "fixed"
        assert "had not settled" in now.note


async def test_a_driver_that_reports_nothing_is_a_refusal_and_the_old_comes_back(
    exposing, monkeypatch, tmp_path
):
    monkeypatch.setattr("services.pi_tracker.endpoints.exposure_control._SETTLE_TIMEOUT_S", 0.3)
    save(
        tmp_path / "calibration" / "left.exposure.json",
        Exposure(exposure_us=7000.0, gain=1.0, red_gain=1.0, blue_gain=1.0),
    )
    camera = Camera(Controls())
    async with exposing(camera) as (service, client):
        with pytest.raises(RefusedError, match="refused: the driver reports no exposure") as caught:
            await client.set_exposure("left", ExposureControl(mode="auto"))
        assert caught.value.code == "unsupported"
        assert service.errors == 0
        assert (await client.exposure("left")).exposure_us == 7000.0
        while len(camera.got) < 2:
            await asyncio.sleep(0.01)
        assert camera.got[1].exposure_us == 7000.0


async def test_half_a_setting_without_the_rest_is_refused(exposing):
    async with exposing(Camera(Controls())) as (_, client):
        with pytest.raises(RefusedError, match="exposure_us must be given once"):
            await client.set_exposure("left", ExposureControl(gain=2.0))


async def test_a_source_without_controls_says_so(exposing):
    async with exposing(None) as (service, client):
        state = await client.exposure("left")
        assert not state.adjustable
        with pytest.raises(RefusedError, match="'simulator' has no exposure to set"):
            await client.set_exposure("left", ExposureControl(gain=2.0))
        # And so does a put by another tool.
        client.bus.put_raw(topics.EXPOSURE.key("desk", camera="left"), b'{"mode":"auto"}')
        while not service.errors:
            await asyncio.sleep(0.01)
        assert "has no exposure to set" in service.last_error


GARBAGE = [
    b"",
    b"[]",
    b'{"mode":"sideways"}',
    b'{"exposure_us":-1}',
    b'{"exposure_us":1e300}',
    b'{"gain":65}',
]


async def test_garbage_is_refused_and_counted(exposing):
    camera = Camera(Controls())
    async with exposing(camera) as (service, client):
        for count, payload in enumerate(GARBAGE, start=1):
            client.bus.put_raw(topics.EXPOSURE.key("desk", camera="left"), payload)
            while service.errors < count:
                await asyncio.sleep(0.01)
            assert "is refused" in service.last_error
        assert camera.got == []
