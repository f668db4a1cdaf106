"""The live view in a browser on this machine: hands, markers, objects, cameras, joint angles,
rates.

Nothing is subscribed to, and nothing is computed, while no browser looks. Late streams are drawn
when they come and hidden when they are a second old; missing ones are said to be missing.
Uncalibrated cameras are left out, with a note.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.process.service import Service
from rhot.topics import Topic
from services.viewer.calibration.page import Calibrate
from services.viewer.live.gui import Gui
from services.viewer.live.model import ViewModel
from services.viewer.live.scene import Scene
from services.viewer.server import Audience, open_server
from services.viewer.setup import read_setup

log = logging.getLogger("rhot.viewer")

# Texts are read, not watched; switches may take as long to act.
_TEXT_S = 0.2


async def serve(service: Service) -> None:
    """Shows the rig live at http://127.0.0.1:8080 (or [viewer] port)."""
    config = service.config
    loop = asyncio.get_running_loop()
    setup = read_setup(config)
    # viser's websocket library tells of every browser that comes and goes.
    logging.getLogger("websockets").setLevel(logging.WARNING)
    with open_server(config.viewer.host, config.viewer.port) as server:
        present = asyncio.Event()
        Audience(
            server, lambda count: loop.call_soon_threadsafe(present.set if count else present.clear)
        )
        gui, scene = (
            Gui(server, config, setup.notes),
            Scene(server, config, setup.cameras, setup.paints),
        )
        calibrating = service.tasks.create_task(Calibrate(service, server).run())
        service.values["port"] = server.get_port()
        log.info("live view at http://127.0.0.1:%d", server.get_port())
        service.ready()
        try:
            while True:
                await present.wait()
                await _live(service, present, gui, scene)
        finally:
            calibrating.cancel()


async def _live(service: Service, present: asyncio.Event, gui: Gui, scene: Scene) -> None:
    """Follow the rig for as long as somebody looks."""
    model = ViewModel()
    async with asyncio.TaskGroup() as tasks:
        followers = [
            tasks.create_task(
                _follow(
                    service.bus,
                    topics.POSE,
                    lambda m: model.pose(m, time.monotonic(), clock.now_ns()),
                )
            ),
            tasks.create_task(
                _follow(service.bus, topics.POINTS, lambda m: model.points(m, time.monotonic()))
            ),
            tasks.create_task(
                _follow(service.bus, topics.OBJECT, lambda m: model.object(m, time.monotonic()))
            ),
            tasks.create_task(
                _follow(service.bus, topics.HEALTH, lambda m: model.health(m, time.monotonic()))
            ),
        ]
        pictures: asyncio.Task[None] | None = None
        text_due_s = 0.0
        while present.is_set():
            now_s = time.monotonic()
            view = model.view(now_s)
            scene.show(view, trails=gui.trails)
            if now_s >= text_due_s:
                text_due_s = now_s + _TEXT_S
                gui.show(view)
                pictures = _switch(tasks, pictures, service, gui)
            await asyncio.sleep(1.0 / service.config.viewer.rate_hz)
        for follower in [*followers, *([pictures] if pictures else [])]:
            follower.cancel()


async def _follow(bus: Bus, topic: Topic[Any], take: Callable[[Any], None]) -> None:
    subscription = bus.latest(topic)
    try:
        async for message in subscription:
            take(message)
    finally:
        bus.close(subscription)


def _switch(
    tasks: asyncio.TaskGroup, pictures: asyncio.Task[None] | None, service: Service, gui: Gui
) -> asyncio.Task[None] | None:
    """Subscribe to previews only while the switch is on: cameras send none otherwise."""
    if gui.pictures == (pictures is not None):
        return pictures
    gui.show_pictures(gui.pictures)
    if pictures is None:
        return tasks.create_task(_follow_pictures(service, gui))
    pictures.cancel()
    return None


async def _follow_pictures(service: Service, gui: Gui) -> None:
    # One being shown and the next of each of two cameras; more would only be older.
    samples = service.bus.raw(topics.PREVIEW, 4)
    try:
        async for sample in samples:
            camera = (topics.PREVIEW.names(sample.key) or {}).get("camera", "")
            if not gui.picture(camera, sample.payload):
                service.error(f"{sample.key} carries no JPEG of a camera of this rig")
    finally:
        service.bus.close(samples)
