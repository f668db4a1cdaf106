"""Frames from a real router."""

from __future__ import annotations

import asyncio
import itertools

import msgspec

from rhot import topics
from rhot.files.config import RigConfig
from services.bridges.endpoints.feed import Feed
from testing.sample_hands import object_pose, random_pose


async def test_frames_hold_what_is_there_and_tell_its_loss(running, sending):
    frames: asyncio.Queue = asyncio.Queue()

    async def serve(service):
        async for frame in Feed(service, 60.0):
            frames.put_nowait(frame)

    async with running("bridge", serve, RigConfig(), instance="vmc") as (_, bus):
        hand, cup = random_pose("right", 1), object_pose("cup")
        hands = bus.publisher(topics.POSE, hand="right")
        cups = bus.publisher(topics.OBJECT, object="cup")
        with sending(lambda: (hands.put(hand), cups.put(cup))):
            while not ((frame := await frames.get()).hands and frame.objects):
                pass
            assert set(frame.hands) == {"right"}
            assert frame.hands["right"].positions_m.tolist() == hand.positions_m.tolist()
            assert set(frame.objects) == {"cup"}
        while (frame := await frames.get()).hands or frame.objects:
            pass


async def test_the_newest_is_sent_to_who_is_slow(running, sending):
    """A bridge that takes half a second for a frame gets the newest, none of those between."""
    seen: list[int] = []

    async def serve(service):
        async for frame in Feed(service, 240.0):
            seen.extend(pose.seq for pose in frame.hands.values())
            await asyncio.sleep(0.5)

    async with running("bridge", serve, RigConfig(), instance="vmc") as (_, bus):
        publisher = bus.publisher(topics.POSE, hand="left")
        sequence = iter(range(10**6))

        def send() -> None:
            publisher.put(msgspec.structs.replace(hand, seq=next(sequence)))

        hand = random_pose("left", 1)
        with sending(send):
            while len(set(seen)) < 3:
                await asyncio.sleep(0.05)
    steps = [b - a for a, b in itertools.pairwise(seen) if b != a]
    assert min(steps) > 5


async def test_what_no_hand_can_be_is_rejected_and_counted(running, sending):
    seen: list[tuple[float, ...]] = []

    async def serve(service):
        feed = Feed(service, 240.0)
        service.ready()
        async for frame in feed:
            seen.extend(pose.wrist.position_m for pose in frame.hands.values())

    async with running("bridge", serve, RigConfig(), instance="vmc") as (service, bus):
        good = random_pose("left", 1)
        wrist = msgspec.structs.replace(good.wrist, position_m=(1e300, 0.0, 0.0))
        bad = msgspec.structs.replace(good, wrist=wrist)
        publisher = bus.publisher(topics.POSE, hand="left")
        while service.state != "running":
            await asyncio.sleep(0.01)
        (stats,) = [one for one in service.bus.streams if one.topic is topics.POSE]
        with sending(lambda: publisher.put(bad)):
            while stats.rejected < 3:
                await asyncio.sleep(0.01)
        assert seen == []
        with sending(lambda: publisher.put(good)):
            while not seen:
                await asyncio.sleep(0.01)
    assert set(seen) == {good.wrist.position_m}
