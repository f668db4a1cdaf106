"""Listens to a rig for some seconds, and asks it what can be asked."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Coroutine
from typing import Any

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.files.config import RigConfig
from rhot.messages import HandPose
from rhot.messages.health import Health
from rhot.messages.objects import ObjectContacts
from rhot.watch.follow import watching
from rhot.watch.object_words import holding, state_of, touching
from rhot.watch.rig_monitor import RigMonitor
from services.cli.doctor.observations import CameraSeen, HandSeen, ObjectSeen, Observations

# Long enough for a beat to be missing (three seconds), and for two beats of each of two namesakes.
LISTEN_S = 4.5
# Seconds of every stream; one that is faster than this is not told apart by a few messages more.
_QUEUE = 4096
# Beyond any room.
_MAX_M = 20.0


async def listen(bus: Bus, config: RigConfig, seen: Observations) -> None:
    """Fill in what the bus tells."""
    monitor = RigMonitor(config, clock.now_ns())
    beats: dict[str, dict[str, int]] = {}
    seen.cameras = {camera.name: CameraSeen() for camera in config.camera}
    seen.hands = {hand: HandSeen() for hand in config.hand}
    seen.objects = {table.name: ObjectSeen() for table in config.object}
    async with watching(bus, monitor), asyncio.TaskGroup() as tasks:
        listeners = [tasks.create_task(one) for one in _listeners(bus, seen, beats)]
        await asyncio.gather(_ask(bus, seen), asyncio.sleep(LISTEN_S))
        for task in listeners:
            task.cancel()
        seen.listened_s = LISTEN_S
        seen.state = monitor.state(clock.now_ns())
    # One beat may be the last of a process that was replaced just now.
    places = {name: [who for who, n in found.items() if n > 1] for name, found in beats.items()}
    seen.doubles = {name: sorted(found) for name, found in places.items() if len(found) > 1}


def _listeners(
    bus: Bus, seen: Observations, beats: dict[str, dict[str, int]]
) -> list[Coroutine[Any, Any, None]]:
    async def health() -> None:
        async for beat in bus.every(topics.HEALTH, _QUEUE):
            count_beat(beats, beat)

    async def markers() -> None:
        async for frame in bus.every(topics.MARKERS, _QUEUE):
            if (camera := seen.cameras.get(frame.camera)) is not None:
                camera.frames += 1
                camera.clock_known += frame.clock_sigma_ns >= 0
                if seen.config is not None:
                    found = {seen.config.color_of(marker.color) for marker in frame.markers}
                    for color in found.intersection(seen.config.colors):
                        camera.colors[color] = camera.colors.get(color, 0) + 1

    async def points() -> None:
        async for message in bus.every(topics.POINTS, _QUEUE):
            if (hand := seen.hands.get(message.hand)) is not None:
                hand.points += 1
                hand.measured += any(point.source == "measured" for point in message.points)

    async def poses() -> None:
        async for pose in bus.every(topics.POSE, _QUEUE):
            if (hand := seen.hands.get(pose.hand)) is not None:
                hand.poses += 1
                hand.implausible += not plausible(pose)

    async def objects() -> None:
        async for pose in bus.every(topics.OBJECT, _QUEUE):
            if (known := seen.objects.get(pose.object)) is not None:
                known.poses += 1
                known.state = state_of(pose.tracking, pose.registered)
                known.ok += known.state == "ok"

    async def contacts() -> None:
        async for message in bus.every(topics.CONTACTS, _QUEUE):
            if (known := seen.objects.get(message.object)) is not None:
                known.contacts += 1
                known.touching = touch_text(message)

    return [health(), markers(), points(), poses(), objects(), contacts()]


def touch_text(message: ObjectContacts) -> str:
    """Who holds an object, else who touches it, in words; "" if nobody does."""
    held = [holding(one.hand, message.object, one.parts) for one in message.grasps]
    by_hand: dict[str, list[str]] = {}
    for one in message.contacts:
        if one.touching and one.hand not in [grasp.hand for grasp in message.grasps]:
            by_hand.setdefault(one.hand, []).append(one.part)
    touched = [touching(hand, message.object, parts) for hand, parts in by_hand.items()]
    return ", ".join([*held, *touched])


# Services and places that are told apart; names come from the network, memory must not.
_MAX_PLACES = 16


def count_beat(beats: dict[str, dict[str, int]], beat: Health) -> None:
    """Count a beat of a service by where it comes from."""
    name = beat.service if beat.instance == "main" else f"{beat.service}/{beat.instance}"
    if name not in beats and len(beats) >= 4 * _MAX_PLACES:
        return
    places = beats.setdefault(name, {})
    place = f"process {beat.pid} on {beat.host or 'a nameless host'}"
    if place in places or len(places) < _MAX_PLACES:
        places[place] = places.get(place, 0) + 1


def plausible(pose: HandPose) -> bool:
    """Whether every joint is where a hand can be: a number, and not beyond any room."""
    return all(
        math.isfinite(value) and abs(value) <= _MAX_M
        for joint in pose.joints
        for value in joint.position_m
    )


async def _ask(bus: Bus, seen: Observations) -> None:
    sessions = await bus.get(topics.SESSION)
    seen.session_running = sessions[0].running if sessions else None
    masters = {
        one.echo.session: one.echo.host or "a nameless host"
        for one in await bus.echoes(clock.now_ns)
    }
    seen.clock_masters = sorted(masters.values())
