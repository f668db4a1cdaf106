"""The live view in a browser on this machine: hands, markers, objects and who touches them,
cameras, joint angles, rates.

Nothing is subscribed to, and nothing is computed, while no browser is connected. Late streams are
drawn when they come and hidden when they are a second old; missing ones are said to be missing.
Uncalibrated cameras are left out, with a note; new lenses and places start the view anew.
Of several rigs each has a page of its own, which leads to the others.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import viser

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.files.config import RigConfig
from rhot.files.viewer_access import page_address
from rhot.process.calibration_watch import load_and_watch
from rhot.process.service import Service
from rhot.topics import Topic
from rhot.watch.follow import watching
from rhot.watch.rig_monitor import RigMonitor
from rhot.watch.rig_state import RigState
from services.viewer.guide.captions import Captions
from services.viewer.guide.section import GuideSection
from services.viewer.live.model import ViewModel
from services.viewer.live.views import View
from services.viewer.pages import RigPage, announced, at_its_place, others
from services.viewer.panel.banner import Banner
from services.viewer.panel.fault_texts import starting
from services.viewer.panel.live_tab import LiveSection
from services.viewer.pictures.feed import PictureFeed
from services.viewer.plots.history import History
from services.viewer.plots.section import PlotsSection
from services.viewer.recording.link import RecorderLink
from services.viewer.recording.replay_page import INSTANCE, ReplayPage
from services.viewer.recording.section import RecordingSection
from services.viewer.scene.layers import LAYERS, LayerName
from services.viewer.scene.scene import LiveScene
from services.viewer.server import open_server
from services.viewer.setup import Setup, read_setup
from services.viewer.visits.layer import Layer
from services.viewer.visits.section import Section, Seen
from services.viewer.visits.visits import Visits

log = logging.getLogger("rhot.viewer")

# Texts are read, not watched; switches may take as long to act.
_TEXT_S = 0.2


@dataclass(frozen=True)
class _Page:
    """What is shown: to each visitor his own tabs, to all one scene and its captions."""

    visits: Visits
    scene: LiveScene
    layers: Mapping[LayerName, Layer]
    history: History
    captions: Captions
    # Whether it shows a recording, not the rig.
    replayed: bool
    # Tells what is stale: while a replay is paused, its time stands still.
    clock_s: Callable[[], float]

    def draw(self, view: View, now_s: float) -> None:
        """What all see."""
        self.scene.show(view, {name for name, layer in self.layers.items() if layer.wanted})
        self.history.take(view, now_s)

    def tell(self, view: View, now_s: float, state: RigState, now_ns: int) -> None:
        """Each visitor's texts."""
        # Of a recording, services that were not recorded are not missed.
        faults = [one for one in state.faults if one.teller or not self.replayed]
        self.visits.update(Seen(view, faults, now_s, now_ns, starting(state.services)))


async def serve(service: Service) -> None:
    """Shows the rig live at http://127.0.0.1:8080 (or [viewer] port)."""
    link = RecorderLink(service.bus)
    replay = ReplayPage(service, link, lambda page: _show(page, link, lambda: ""))
    for running in (link.run(), replay.run()):
        service.tasks.create_task(running)
    await _show(service, link, lambda: _address(service, replay.port) if replay.port else "")


def _address(service: Service, port: int) -> str:
    return page_address(service.config.viewer, port, socket.gethostname())


async def _show(service: Service, link: RecorderLink, replay_address: Callable[[], str]) -> None:
    """One page, for ever: of the rig, or of what is replayed under another name."""
    config = service.config
    setup = load_and_watch(service, _watched(config), lambda: read_setup(config))
    # viser's websocket library logs every browser that comes and goes.
    logging.getLogger("websockets").setLevel(logging.WARNING)
    with open_server(at_its_place(config.viewer)) as server:
        own = RigPage(config.rig.name, config.viewer, server.get_port(), socket.gethostname())
        page = _page(service, server, setup, link, own, replay_address)
        service.values["port"] = own.port
        log.info("live view at %s", _address(service, own.port))
        service.ready()
        try:
            with contextlib.nullcontext() if page.replayed else announced(own):
                while True:
                    await page.visits.anybody.wait()
                    await _show_live(service, page)
        finally:
            page.visits.close()


def _watched(config: RigConfig) -> list[Path]:
    """The files that a page begins anew with.

    Not the colours, which this page itself changes: a marker is drawn in a colour it had before.
    """
    names = ["rig.json", "objects.json", *(f"{camera.name}.lens.json" for camera in config.camera)]
    names += [f"hand.{hand}.json" for hand in config.hand]
    return [config.calibration_dir / name for name in names]


def _page(
    service: Service,
    server: viser.ViserServer,
    setup: Setup,
    link: RecorderLink,
    own: RigPage,
    replay_address: Callable[[], str],
) -> _Page:
    """The page with its tabs: those of a rig, or those of a recording."""
    config, replayed = service.config, service.instance == INSTANCE
    layers = {name: Layer(f"/{name}") for name in LAYERS}
    feed, history = PictureFeed(service), History(config)
    sections: list[Section] = [
        LiveSection(config, setup.notes, feed, layers, lambda: others(own), replayed=replayed),
        PlotsSection(config, history),
        RecordingSection(link, config.rig.name, replay_address),
    ]
    # Nobody answers for cameras of what is replayed.
    if not replayed:
        sections.append(GuideSection(service))
    return _Page(
        Visits(server, Banner, sections),
        LiveScene(server, config, setup.cameras, setup.paints, setup.looks, setup.models),
        layers,
        history,
        Captions(server),
        replayed,
        link.now_s if replayed else time.monotonic,
    )


async def _show_live(service: Service, page: _Page) -> None:
    """Subscribe and draw for as long as a browser is connected."""
    rig = RigMonitor(service.config, clock.now_ns())
    model = ViewModel()
    async with watching(service.bus, rig), asyncio.TaskGroup() as tasks:
        followers = [
            tasks.create_task(_follow(service.bus, topic, take))
            for topic, take in _handlers(model, service.config, page.clock_s)
        ]
        followers.append(tasks.create_task(page.captions.follow(service.bus)))
        text_due_s = due_s = 0.0
        while page.visits.anybody.is_set():
            now_s, tick_s = page.clock_s(), time.monotonic()
            view = model.view(now_s)
            page.draw(view, now_s)
            if tick_s >= text_due_s:
                text_due_s, now_ns = tick_s + _TEXT_S, clock.now_ns()
                page.tell(view, now_s, rig.state(now_ns), now_ns)
            # By the clock: what drawing takes is not added to each picture's time.
            due_s = max(due_s, tick_s) + 1.0 / service.config.viewer.rate_hz
            await asyncio.sleep(due_s - time.monotonic())
        for follower in followers:
            follower.cancel()


def _handlers(
    model: ViewModel, config: RigConfig, now_s: Callable[[], float]
) -> list[tuple[Topic[Any], Callable[[Any], None]]]:
    """What is subscribed to, and who takes it."""
    handlers: list[tuple[Topic[Any], Callable[[Any], None]]] = [
        (topics.POSE, lambda message: model.pose(message, now_s(), clock.now_ns())),
        (topics.POINTS, lambda message: model.points(message, now_s())),
        (topics.OBJECT, lambda message: model.object(message, now_s())),
        (topics.HEALTH, lambda message: model.health(message, now_s())),
    ]
    # Of objects without a shape nobody can say who touches them: nothing would come.
    if any(table.shape for table in config.object):
        handlers.append(
            (topics.CONTACTS, lambda message: model.contacts(message, now_s())),
        )
    return handlers


async def _follow(bus: Bus, topic: Topic[Any], take: Callable[[Any], None]) -> None:
    subscription = bus.latest(topic)
    try:
        async for message in subscription:
            take(message)
    finally:
        bus.close(subscription)
