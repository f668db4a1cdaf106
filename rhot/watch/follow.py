"""Feeds a RigMonitor from the bus, for `rhot top`, `rhot doctor`, the page and the metrics."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.watch.rig_monitor import RigMonitor

# Beats of a rig for some seconds; more can only come from who is broken or hostile.
_QUEUE = 256
# A lost router is noticed within two seconds anyway.
_POLL_S = 0.5


@contextlib.asynccontextmanager
async def watching_objects(bus: Bus, monitor: RigMonitor) -> AsyncIterator[None]:
    """As watching(), and the monitor's state has objects, too: for `rhot top` and the metrics."""
    objects = monitor.watch_objects()
    poses, contacts = bus.latest(topics.OBJECT), bus.latest(topics.CONTACTS)

    async def follow_poses() -> None:
        async for pose in poses:
            objects.pose(pose, clock.now_ns())

    async def follow_contacts() -> None:
        async for one in contacts:
            objects.contacts(one, clock.now_ns())

    async with watching(bus, monitor), asyncio.TaskGroup() as tasks:
        listeners = [tasks.create_task(one) for one in (follow_poses(), follow_contacts())]
        try:
            yield
        finally:
            for task in listeners:
                task.cancel()
            bus.close(poses)
            bus.close(contacts)


@contextlib.asynccontextmanager
async def watching(bus: Bus, monitor: RigMonitor) -> AsyncIterator[None]:
    """Beats, tokens and the connection reach the monitor for as long as the block lasts."""
    health, alive = bus.every(topics.HEALTH, _QUEUE), bus.watch_alive()

    async def beats() -> None:
        async for beat in health:
            monitor.beat(beat, clock.now_ns())

    async def tokens() -> None:
        async for change in alive:
            monitor.token(change.service, change.instance, change.alive, clock.now_ns())

    async def connection() -> None:
        while True:
            monitor.connected(bool(bus.routers), clock.now_ns())
            await asyncio.sleep(_POLL_S)

    async with asyncio.TaskGroup() as tasks:
        listeners = [tasks.create_task(one) for one in (beats(), tokens(), connection())]
        try:
            yield
        finally:
            for task in listeners:
                task.cancel()
            bus.close(health)
            bus.close(alive)
