"""A service and its companion in one process, on a real router."""

from __future__ import annotations

import asyncio

import msgspec
import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import SourceError, leaves
from rhot.files.config import RigConfig, load_rig
from rhot.messages import Session
from rhot.process.rigs.context import who
from rhot.process.served import Companion, Served
from rhot.process.service import Service

DEADLINE_S = 30.0


@pytest.fixture
def config(tmp_path, router) -> RigConfig:
    path = tmp_path / "rig.toml"
    path.write_text(f'[bus]\nconnect = ["{router}"]\n[[camera]]\nname = "left"\n')
    return load_rig(path)


def every_rig(config: RigConfig) -> bool:
    return config.rig.name != ""


def both(own, other, of=every_rig) -> Served:
    class Solver(Companion):
        def imported(self):
            return other

    return Served("fusion", "main", own, Solver("solver", "solve", "", of, ""))


async def forever(service: Service) -> None:
    service.ready()
    await asyncio.Event().wait()


async def test_each_has_a_health_of_its_own_over_one_session(config):
    async def publishes(service: Service) -> None:
        service.bus.publisher(topics.SESSION)
        service.bus.publisher(topics.POINTS, hand="right")
        await forever(service)

    async def listens(service: Service) -> None:
        service.bus.latest(topics.POINTS, hand="right")
        await forever(service)

    async with open_bus(config.rig.name, config.bus.connect) as bus:
        beats, found = bus.every(topics.HEALTH, 16), {}
        task = asyncio.create_task(both(publishes, listens).serve_rig(config))
        async with asyncio.timeout(DEADLINE_S):
            while len(found) < 2:
                beat = await anext(beats)
                found[beat.service] = beat
        task.cancel()
    points = {name: [one.direction for one in beat.streams] for name, beat in found.items()}
    assert points == {"fusion": ["out"], "solver": ["in"]}
    assert found["fusion"].session == found["solver"].session


async def test_one_hears_the_other_without_the_router(config):
    heard: asyncio.Future[Session] = asyncio.get_running_loop().create_future()
    sent = Session(start_ns=5, running=True)

    async def publishes(service: Service) -> None:
        publisher = service.bus.publisher(topics.SESSION)
        while not heard.done():
            publisher.put(sent)
            await asyncio.sleep(0.01)

    async def listens(service: Service) -> None:
        heard.set_result(await anext(service.bus.every(topics.SESSION, 4)))

    async with asyncio.timeout(DEADLINE_S):
        await both(publishes, listens).serve_rig(config)
    assert msgspec.structs.replace(heard.result(), sent_ns=0) == sent


async def test_an_error_of_one_ends_both(config):
    ended = asyncio.Event()

    async def waits(service: Service) -> None:
        try:
            await forever(service)
        finally:
            ended.set()

    async def fails(service: Service) -> None:
        raise SourceError("gone")

    with pytest.raises(ExceptionGroup) as raised:
        async with asyncio.timeout(DEADLINE_S):
            await both(waits, fails).serve_rig(config)
    assert [str(error) for error in leaves(raised.value)] == ["gone"]
    assert ended.is_set()


async def test_a_companion_is_left_out_of_rigs_that_it_is_not_for(config):
    async def never(service: Service) -> None:
        raise SourceError("it was asked")

    async def done(service: Service) -> None:
        return

    async with asyncio.timeout(DEADLINE_S):
        await both(done, never, of=lambda config: config.has_depth).serve_rig(config)


async def test_what_it_says_names_it(config):
    names = []

    async def says(service: Service) -> None:
        names.append(who("fusion/main"))

    async with asyncio.timeout(DEADLINE_S):
        await both(says, says).serve_rig(config)
    assert sorted(names) == ["fusion/main", "solver"]
