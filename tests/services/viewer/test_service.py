"""The running viewer: a real router, a real viser server, and a browser made of a websocket."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

from rhot import topics
from rhot.bus import Bus, open_bus
from rhot.config import RigConfig
from rhot.messages import HandPoints, HandPose, Health, ObjectPose
from rhot.service import Service
from services.viewer.service import serve

Make = Callable[..., Any]
JPEG = b"\xff\xd8\xff\xe0picture"


@contextlib.asynccontextmanager
async def running(router: str, config: RigConfig) -> AsyncIterator[tuple[Service, Bus]]:
    """The service in this process, and a bus of our own."""
    async with (
        open_bus("desk", [router]) as theirs,
        open_bus("desk", [router]) as ours,
        asyncio.timeout(20.0),
        asyncio.TaskGroup() as tasks,
    ):
        service = Service("viewer", "main", config, theirs, tasks)
        task = tasks.create_task(serve(service))
        await until(lambda: service.state == "running")
        yield service, ours
        task.cancel()


async def until(condition: Callable[[], object]) -> None:
    """Wait for a condition; the caller has a deadline."""
    while not condition():
        await asyncio.sleep(0.01)


@contextlib.contextmanager
def sending(send: Callable[[], None]) -> Iterator[None]:
    """Send again and again in the background."""

    async def repeat() -> None:
        while True:
            send()
            await asyncio.sleep(0.02)

    task = asyncio.create_task(repeat())
    try:
        yield
    finally:
        task.cancel()


async def test_what_is_published_is_drawn_and_told(
    router: str, config: RigConfig, browse: Make, make_pose: Make, make_points: Make, make_object: Make, make_health: Make
) -> None:
    async with running(router, config) as (service, bus):
        pose, points = bus.publisher(topics.POSE, hand="right"), bus.publisher(topics.POINTS, hand="right")
        thing, health = bus.publisher(topics.OBJECT, object="cup"), bus.publisher(topics.HEALTH, service="fusion", instance="main")

        def send() -> None:
            message: HandPose | HandPoints | ObjectPose | Health
            for publisher, message in (
                (pose, make_pose()),
                (points, make_points("index_tip")),
                (thing, make_object()),
                (health, make_health()),
            ):
                publisher.put(message)  # type: ignore[arg-type]
            for key in ("hand/right/pose", "hand/right/points", "object/cup/pose", "service/fusion/main/health"):
                bus.put_raw(f"rhot/desk/{key}", b'\xff{"garbage"')

        browser = await asyncio.to_thread(browse, int(service.values["port"]))
        with sending(send):
            for type_, fields in (
                ("BatchedMeshesMessage", {"name": "/hands/right/joints"}),
                ("BatchedMeshesMessage", {"name": "/hands/right/points"}),
                ("SetPositionMessage", {"name": "/objects/cup"}),
                ("GuiUpdateMessage", {"updates": lambda u: "right hand: tracked" in u.get("content", "")}),
                ("GuiUpdateMessage", {"updates": lambda u: "hand/right/points" in u.get("content", "")}),
                ("GuiUpdateMessage", {"updates": lambda u: "57&deg;" in u.get("content", "")}),
            ):
                await asyncio.to_thread(browser.wait_for, type_, **fields)
            await until(lambda: sum(stats.rejected for stats in service.bus.streams) >= 4)
        browser.forget()
        # Nothing comes any more: the hand is hidden, and said to be missing.
        await asyncio.to_thread(browser.wait_for, "SetSceneNodeVisibilityMessage", name="/hands/right/joints", visible=False)
        await asyncio.to_thread(browser.wait_for, "GuiUpdateMessage", updates=lambda u: "waiting for hand poses" in u.get("content", ""))


async def test_uncalibrated_cameras_are_left_out_with_a_note(router: str, config: RigConfig, browse: Make) -> None:
    async with running(router, config) as (service, _):
        browser = await asyncio.to_thread(browse, int(service.values["port"]))
        status = await asyncio.to_thread(browser.wait_for, "GuiHtmlMessage")
        assert "camera left is not drawn: rig.json: no such file" in status["props"]["content"]
        assert "waiting for hand poses" in status["props"]["content"]


async def test_nothing_is_done_while_nobody_looks(router: str, config: RigConfig, browse: Make, make_pose: Make) -> None:
    async with running(router, config) as (service, bus):
        publisher = bus.publisher(topics.POSE, hand="right")
        assert service.bus.streams == []
        assert not publisher.wanted
        for _ in range(2):
            browser = await asyncio.to_thread(browse, int(service.values["port"]))
            await until(lambda: publisher.wanted)
            assert len(service.bus.streams) == 4
            await asyncio.to_thread(browser.close)
            await until(lambda: not publisher.wanted)
            assert service.bus.streams == []


async def test_pictures_are_asked_for_only_while_the_switch_is_on(router: str, config: RigConfig, browse: Make) -> None:
    async with running(router, config) as (service, bus):
        publisher = bus.publisher(topics.PREVIEW, camera="left")
        browser = await asyncio.to_thread(browse, int(service.values["port"]))
        switch = await asyncio.to_thread(browser.wait_for, "GuiCheckboxMessage", props=lambda p: p["label"] == "camera pictures")
        assert not publisher.wanted
        browser.click(switch["uuid"], True)
        await until(lambda: publisher.wanted)

        def send() -> None:
            publisher.put_bytes(JPEG)
            bus.put_raw("rhot/desk/camera/right/preview", b"<script>")
            bus.put_raw("rhot/desk/camera/nobody/preview", JPEG)

        with sending(send):
            shown = await asyncio.to_thread(
                browser.wait_for, "GuiUpdateMessage", updates=lambda u: "data:image/jpeg" in u.get("content", "")
            )
            assert "left<br>" in shown["updates"]["content"]
            await until(lambda: service.errors >= 2)
        assert "no JPEG of a camera" in service.last_error
        browser.click(switch["uuid"], False)
        await until(lambda: not publisher.wanted)
