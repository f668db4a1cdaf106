"""`rhot demo --tour` on the whole simulated rig: what it announces happens in the messages."""

from __future__ import annotations

import asyncio

import pytest

from rhot import clock, topics
from rhot.files.config import load_rig
from rhot.messages.simulator import SimStage
from services.cli.demo.evidence import Evidence
from services.cli.demo.metrics import DemoMetrics
from services.cli.demo.narrator import Narrator
from services.cli.demo.tour import STEPS, Tour, touring
from services.cli.terminal import Terminal

pytestmark = [pytest.mark.integration, pytest.mark.asyncio(loop_scope="module")]

# Reading is left out; what remains is how long the rig takes to notice.
PACE = 0.02
DEADLINE_S = 240.0


class Onlooker:
    """What an ordinary program of the rig sees, with the caption that was said before it."""

    def __init__(self, bus) -> None:
        self.seen: list[tuple[str, str]] = []
        self.titles: list[str] = []
        self.captions: list[str] = []
        self._bus = bus
        self._step = ""

    def _note(self, what: str) -> None:
        if (self._step, what) not in self.seen:
            self.seen.append((self._step, what))

    async def captions_said(self) -> None:
        async for caption in self._bus.every(topics.CAPTION, 64):
            self._step = caption.title
            if caption.title not in self.titles:
                self.titles.append(caption.title)
            if caption.text not in self.captions:
                self.captions.append(caption.text)

    async def points(self) -> None:
        async for message in self._bus.every(topics.POINTS, 256):
            tip = message.point("index_tip")
            self._note("tip measured" if tip and tip.source == "measured" else "tip lost")

    async def health(self) -> None:
        async for beat in self._bus.every(topics.HEALTH, 64):
            if beat.service == "fusion":
                codes = [fault.code for fault in beat.faults]
                self._note("moved" if "camera_moved" in codes else "not moved")
                self._note("missed" if "marker_not_seen" in codes else "none missed")

    async def contacts(self) -> None:
        async for message in self._bus.every(topics.CONTACTS, 256):
            if sum(one.touching for one in message.contacts) >= 2:
                self._note("touched")
            if message.grasps:
                self._note("held")


async def test_everything_that_the_tour_announces_happens(rig) -> None:
    onlooker, metrics = Onlooker(rig.bus), DemoMetrics()
    narrator = Narrator(rig.bus, Terminal(), STEPS, PACE)
    config = load_rig(rig.config)
    tour = Tour(rig.bus, config, narrator, Evidence(), metrics)

    async def poses() -> None:
        async for pose in rig.bus.every(topics.POSE, 256):
            metrics.add_pose(pose, clock.now_ns())

    watching = [onlooker.captions_said(), onlooker.points(), onlooker.health(), onlooker.contacts()]
    tasks = [asyncio.create_task(one) for one in (*watching, poses(), touring(tour))]
    try:
        await rig.until(lambda: "released" in tour.happened, DEADLINE_S)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await rig.bus.request(topics.SIM_STAGE, SimStage(), timeout_s=60.0)
    assert all(tour.happened.values()), tour.happened
    alive, paint, bump, grasp = onlooker.titles
    # The tour begins with poses; at this pace its first step may be over before the next points.
    assert "tip measured" in [what for step, what in onlooker.seen if step in ("", alive)]
    order = [what for step, what in onlooker.seen if step == paint]
    assert order.index("tip lost") < order.index("missed")
    assert (bump, "moved") in onlooker.seen
    assert {"touched", "held"} <= {what for step, what in onlooker.seen if step == grasp}
    assert any("blue" in text and "\u201c" in text for text in onlooker.captions)
    assert any("has moved" in text for text in onlooker.captions)
