"""The tour of `rhot demo --tour`: a hand alive, paint lost and found, a bumped camera, a grasp.

Everything is done to the simulated rig (SimStage) and happens there: each sentence that says so
waits for the messages that show it. What does not show in time is said to have failed.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Coroutine
from dataclasses import dataclass
from typing import Any

from rhot import topics
from rhot.bus.bus import Bus
from rhot.files.config import RigConfig
from rhot.hand import HandName
from rhot.messages.simulator import SimStage
from services.cli.demo.evidence import Evidence
from services.cli.demo.metrics import DemoMetrics
from services.cli.demo.narrator import Narrator, until

# Of the first steps, in which all tips are in view of both cameras.
SCENE = "piano"
STEPS = 4
# A camera turned by .7 deg shifts its picture by 6 px, four times what is told as moved
# (services/fusion/monitors/moved_camera.py): what a cable does that somebody walks into.
_BUMP_DEG = 0.7
# A marker is told as missing after 6 s, a camera as moved after 1 to 5; on a busy machine it takes
# a multiple.
_PATIENCE_S = 30.0
# A scene with a grasp repeats every 8 s.
_GRASP_S = 40.0
# The simulator searches where the hand takes the object.
_STAGE_S = 30.0


@dataclass
class Tour:
    """One round after the other; happened says what was seen of the last one, by name."""

    bus: Bus
    config: RigConfig
    narrator: Narrator
    evidence: Evidence
    metrics: DemoMetrics

    def __post_init__(self) -> None:
        self.happened: dict[str, bool] = {}
        self._hand: HandName = next(iter(self.config.hand))
        self._camera = self.config.camera[-1].name
        self._object = self.config.object[0].name

    async def round(self) -> None:
        """All steps, once; the rig is as it should be afterwards."""
        self.happened = {}
        self.narrator.begin()
        await self._show(SimStage(scene=SCENE))
        await self._alive()
        await self._lost_and_found()
        await self._bumped()
        await self._grasp()

    async def _show(self, stage: SimStage) -> None:
        await self.bus.request(topics.SIM_STAGE, stage, timeout_s=_STAGE_S)

    async def _alive(self) -> None:
        say = self.narrator.say
        self.narrator.title("A hand, from paint and two cameras")
        poses = self.metrics.poses
        self._note("alive", await until(lambda: self.metrics.poses > poses, _PATIENCE_S))
        await say(
            "Two simulated cameras look at a hand with a dab of paint on each finger tip and one "
            "on the wrist. From these six dots rhot works out all 26 joints, live."
        )
        error_mm = self.metrics.tip_error_mm(last=60)
        if error_mm is not None:
            await say(
                f"The simulator knows where the hand really is: just now the finger tips are "
                f"{error_mm:.1f} mm off."
            )

    async def _lost_and_found(self) -> None:
        say, hand = self.narrator.say, self._hand
        landmark = "index_tip"
        color = self.config.hand[hand].markers[landmark]
        self.narrator.title("Paint is lost, and found again")
        await until(lambda: self.evidence.measured(hand, landmark), _PATIENCE_S)
        await say(f"Now the {color} paint on the index finger is covered up.")
        await self._show(SimStage(scene=SCENE, hidden=[f"{hand}.{landmark}"]))
        lost = await until(lambda: self.evidence.measured(hand, landmark) is False, _PATIENCE_S)
        if self._note("lost", lost):
            await say(
                "No camera sees it any more. The hand does not fall apart: the index finger is "
                "predicted from the rest, and marked as predicted."
            )
        told = await until(lambda: self.evidence.fault("marker_not_seen", color), _PATIENCE_S)
        fault = self.evidence.fault("marker_not_seen", color)
        if self._note("lost_told", told) and fault:
            await say(f"After some seconds rhot says so itself: \u201c{fault.text}\u201d.")
        await self._show(SimStage(scene=SCENE))
        found = await until(lambda: self.evidence.measured(hand, landmark), _PATIENCE_S)
        if self._note("found", found) and found is not None:
            await say(
                f"The paint is back. It was found again after {found:.1f} s, and the finger is "
                "measured as before."
            )

    async def _bumped(self) -> None:
        say, camera = self.narrator.say, self._camera
        self.narrator.title("A camera is bumped")
        await say(
            f"Somebody walks into the {camera} camera: it is turned by {_BUMP_DEG:g} degrees."
        )
        await self._show(SimStage(scene=SCENE, turned_deg={camera: (_BUMP_DEG, 0.0, 0.0)}))
        told = await until(lambda: self.evidence.fault("camera_moved", camera), _PATIENCE_S)
        fault = self.evidence.fault("camera_moved", camera)
        if self._note("bump_told", told) and fault:
            await say(
                f"{told:.0f} s later rhot has noticed: \u201c{fault.text}\u201d. What to do about "
                f"it: {fault.action}."
            )
        await self._show(SimStage(scene=SCENE))
        over = await until(lambda: self.evidence.fault("camera_moved", camera) is None, _PATIENCE_S)
        if self._note("bump_over", over):
            await say(
                "The camera is back where it was when it was calibrated: the warning is over."
            )

    async def _grasp(self) -> None:
        say, thing = self.narrator.say, self._object
        self.narrator.title(f"The hand takes a {thing}")
        await self._show(SimStage(scene="grasp"))
        await say(
            f"The {thing} carries a Vive tracker. rhot knows its shape, and so where the skin "
            "touches it."
        )
        touched = await until(lambda: len(self.evidence.touching(thing)) >= 2, _GRASP_S)
        if self._note("touched", touched):
            parts = " and ".join(self.evidence.touching(thing)[:2])
            await say(f"{parts.capitalize()} touch the {thing}: fingers that touch are lit.")
        held = await until(lambda: self.evidence.grasp(thing), _GRASP_S)
        grasp = self.evidence.grasp(thing)
        if self._note("held", held) and grasp:
            await say(f"Now the {grasp.hand} hand holds it, with {_listed(list(grasp.parts))}.")
        put_back = await until(lambda: self.evidence.grasp(thing) is None, _GRASP_S)
        if self._note("released", put_back):
            await say(
                "It is put back. All of this is on the bus as plain messages: your own program "
                "sees every touch and every grasp."
            )

    def _note(self, event: str, after_s: float | None) -> bool:
        """Whether an event was seen, which is kept."""
        self.happened[event] = after_s is not None
        return after_s is not None


async def touring(tour: Tour) -> None:
    """Give the tour again and again, from the first pose on, for ever."""
    async with asyncio.TaskGroup() as tasks:
        for follower in _followers(tour.bus, tour.evidence):
            tasks.create_task(follower)
        tasks.create_task(tour.narrator.repeat())
        while True:
            await until(lambda: tour.metrics.poses, math.inf)
            await tour.round()


def _followers(bus: Bus, evidence: Evidence) -> list[Coroutine[Any, Any, None]]:
    async def points() -> None:
        async for message in bus.every(topics.POINTS, 256):
            evidence.add_points(message)

    async def health() -> None:
        async for beat in bus.every(topics.HEALTH, 64):
            evidence.add_health(beat)

    async def contacts() -> None:
        async for message in bus.every(topics.CONTACTS, 256):
            evidence.add_contacts(message)

    return [points(), health(), contacts()]


def _listed(words: list[str]) -> str:
    """`thumb, index and middle`."""
    return ", ".join(words[:-1]) + f" and {words[-1]}" if len(words) > 1 else "".join(words)
