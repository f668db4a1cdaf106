"""A right hand that pinches once a second and takes a cup in between, as messages on a real bus."""

from __future__ import annotations

import asyncio
import time

import numpy as np

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.hand import default_hand
from rhot.messages import HandPose
from rhot.messages.objects import Grasp, ObjectContacts
from testing.sample_hands import hand_pose, object_pose

_MODEL = default_hand("right")
_OPEN = np.zeros((5, 4))
# The ends of thumb and index finger are 12 mm apart there.
_PINCHED = np.radians([[18.0, 30.0, 15.0, 14.0], [1.0, 47.0, 57.0, 35.0], *[[0.0] * 4] * 3])


def pose_at(seconds: float, stamp_ns: int, seq: int) -> HandPose:
    """The hand at a time of its own: pinched at each half second, open at each full one."""
    share = 0.5 - 0.5 * np.cos(2.0 * np.pi * seconds)
    angles = _OPEN + share * (_PINCHED - _OPEN)
    wrist_m = np.array([0.0, 0.05, 0.5])
    return hand_pose(_MODEL, np.eye(3), wrist_m, angles, stamp_ns=stamp_ns, seq=seq)


async def stream_hand(endpoint: str, seconds: float) -> None:
    """Publish poses, a cup and grasps at 60 Hz, on a rig called desk."""
    async with open_bus("desk", [endpoint]) as bus:
        bus.alive("solver", "main")
        poses = bus.publisher(topics.POSE, hand="right")
        cups = bus.publisher(topics.OBJECT, object="cup")
        contacts = bus.publisher(topics.CONTACTS, object="cup")
        begin_s, seq, held, ended = time.monotonic(), 0, [], []
        while (now_s := time.monotonic() - begin_s) < seconds:
            stamp_ns, seq = clock.now_ns(), seq + 1
            poses.put(pose_at(now_s, stamp_ns, seq))
            cups.put(object_pose("cup", stamp_ns=stamp_ns, seq=seq))
            holds = now_s % 1.0 > 0.5
            if holds and not held:
                held = [Grasp(hand="right", parts=["thumb", "index"], since_ns=stamp_ns)]
            elif held and not holds:
                (last,) = held
                held = []
                ended = [
                    Grasp(hand="right", parts=last.parts, since_ns=last.since_ns, until_ns=stamp_ns)
                ]
            contacts.put(
                ObjectContacts(
                    object="cup",
                    seq=seq,
                    stamp_ns=stamp_ns,
                    contacts=[],
                    grasps=held,
                    ended=ended,
                )
            )
            await asyncio.sleep(1.0 / 60.0)
