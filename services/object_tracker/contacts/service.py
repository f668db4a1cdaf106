"""Contacts as part of the running object tracker: hand/<h>/pose in, object/<o>/contacts out.

Only where rig.toml gives some object a shape. Every pose counts (16 wait at most): a touch is made
of many. Late objects: they are predicted to the hand's instant, or their contacts are not told.
Missing hands: their touches and grasps end half a second later.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

import numpy as np

from rhot import topics
from rhot.bus.bus import Publisher
from rhot.geometry.solids import Solid
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.process.service import Service
from services.object_tracker.contacts.step import ContactStep, solids_of

# How often hands that send nothing any more are looked for.
_IDLE_S = 0.2


async def start_contacts(
    service: Service, consumers: list[Callable[[ObjectPose], None]]
) -> ContactStep | None:
    """Load the shapes and start to publish contacts; None if no object has a shape.

    consumers gets who wants every ObjectPose. Raises ConfigError or CalibrationError if a shape
    cannot be used.
    """
    config = service.config
    if not any(item.shape for item in config.object):
        return None
    # Reading a mesh, and compiling what measures it, must not stop the heartbeat.
    solids = await asyncio.get_running_loop().run_in_executor(None, _load, service)
    step = ContactStep(solids)
    consumers.append(step.note)
    publishers = {name: service.bus.publisher(topics.CONTACTS, object=name) for name in solids}
    clock = _HandClock()
    service.tasks.create_task(_follow(service, step, publishers, clock))
    service.tasks.create_task(_end_what_is_gone(step, publishers, clock))
    return step


def _load(service: Service) -> dict[str, Solid]:
    solids = solids_of(service.config)
    for solid in solids.values():
        solid.distance(np.zeros((1, 3)))
    return solids


class _HandClock:
    """The hands' clock, carried on by this machine's while no pose comes."""

    def __init__(self) -> None:
        self._stamp_ns: int | None = None
        self._at_ns = 0

    def set(self, stamp_ns: int) -> None:
        self._stamp_ns, self._at_ns = stamp_ns, time.monotonic_ns()

    def now_ns(self) -> int | None:
        if self._stamp_ns is None:
            return None
        return self._stamp_ns + time.monotonic_ns() - self._at_ns


Publishers = dict[str, Publisher[ObjectContacts]]


async def _follow(
    service: Service, step: ContactStep, publishers: Publishers, clock: _HandClock
) -> None:
    """Publish what each pose of a hand changes, for ever."""
    async for pose in service.bus.every(topics.POSE, 16):
        clock.set(pose.stamp_ns)
        for message in step.step(pose):
            publishers[message.object].put(message)


async def _end_what_is_gone(step: ContactStep, publishers: Publishers, clock: _HandClock) -> None:
    """End touches and grasps of hands that are heard of no more, for ever."""
    while True:
        await asyncio.sleep(_IDLE_S)
        now_ns = clock.now_ns()
        for message in step.idle(now_ns) if now_ns is not None else ():
            publishers[message.object].put(message)
