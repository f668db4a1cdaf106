"""The page and a real recorder over a real router: recorded, listed, replayed on its own page."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import Bus as BusTable
from rhot.messages.recording import RecorderRequest
from rhot.process.service import Service
from services.recorder.service import serve_on_request
from services.viewer.recording.link import RecorderLink
from services.viewer.recording.replay_page import ReplayPage
from testing.recorded_hand import write_hand
from testing.waiting import until


@pytest.fixture
async def page(
    running: Callable, router: str, tmp_path: Path
) -> AsyncIterator[tuple[Service, RecorderLink]]:
    config = RigConfig(folder=str(tmp_path), bus=BusTable(connect=(router,)))
    (tmp_path / "recordings").mkdir()
    write_hand(tmp_path / "recordings" / "a.mcap", config, 2.0)
    async with running("recorder", serve_on_request, config) as (service, bus):
        await until(lambda: service.state == "running")
        viewer = Service("viewer", "main", config, bus, service.tasks)
        link = RecorderLink(bus)
        service.tasks.create_task(link.run())
        yield viewer, link


async def test_what_is_asked_for_is_done_and_refusals_are_told(
    page: tuple[Service, RecorderLink],
) -> None:
    _, link = page
    stop = link.watch()
    await until(lambda: link.recordings is not None)
    assert [one.name for one in link.recordings.recordings] == ["a.mcap"]
    link.ask(RecorderRequest(do="record"))
    await until(lambda: link.state is not None and link.state.file)
    link.ask(RecorderRequest(do="record"))
    await until(lambda: "already" in link.problem)
    link.ask(RecorderRequest(do="stop"))
    await until(lambda: not link.state.file)
    await until(lambda: len(link.recordings.recordings) == 2)
    stop()


async def test_a_paused_replay_stays_in_the_picture(page: tuple[Service, RecorderLink]) -> None:
    _, link = page
    link.watch()
    link.ask(RecorderRequest(do="open", name="a.mcap", loop=True))
    await until(lambda: link.state is not None and link.state.replay is not None)
    link.ask(RecorderRequest(do="pause"))
    await until(lambda: link.state.replay.state == "paused")
    stands_s = link.now_s()
    await asyncio.sleep(0.1)
    assert link.now_s() == stands_s
    link.ask(RecorderRequest(do="play"))
    await until(lambda: link.now_s() > stands_s)


async def test_a_replay_has_a_page_while_it_is_open(
    page: tuple[Service, RecorderLink],
) -> None:
    service, link = page
    link.watch()
    shown: list[Service] = []

    async def show(one: Service) -> None:
        shown.append(one)
        one.values["port"] = 1234
        await asyncio.Event().wait()

    replay = ReplayPage(service, link, show)
    task = asyncio.create_task(replay.run())
    link.ask(RecorderRequest(do="open", name="a.mcap", loop=True))
    await until(lambda: replay.port == 1234)
    assert (shown[0].config.rig.name, shown[0].bus.rig) == ("desk-replay", "desk-replay")
    assert service.config.rig.name == "desk"
    link.ask(RecorderRequest(do="close"))
    await until(lambda: replay.port == 0)
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task
