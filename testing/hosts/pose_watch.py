"""Looks at a rig's poses beside the simulator's truth: `python -m testing.hosts.pose_watch`.

A process of its own, since it has to live in the network of a host. One JSON object a line on
standard output: {"at_s", "age_s", "measured", "error_m"} for each pose, a little later than it
came, where at_s is CLOCK_MONOTONIC, which all of this machine shares; {"at_s", "health": Health}
for each beat.
"""

from __future__ import annotations

import argparse
import asyncio
import bisect
import math
import sys
import time
from collections import deque
from collections.abc import Iterable

import msgspec

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.hand import JOINTS
from rhot.messages import HandPose
from rhot.messages.simulator import Truth

# Of truth, at 15 to 60 instants a second: poses are never that late and still of use.
_REMEMBERED = 600
# The truth of a pose's instant comes after the pose, as the simulator sends it at a camera's rate.
TRUTH_LATE_S = 0.25
_COMPARED = ("wrist", "thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip")


class TruthTrack:
    """The last instants of the truth, to compare poses with."""

    def __init__(self) -> None:
        self._lines: deque[Truth] = deque(maxlen=_REMEMBERED)

    def add(self, truth: Truth) -> None:
        """The next instant; a scene that began anew starts the track anew."""
        if self._lines and truth.stamp_ns <= self._lines[-1].stamp_ns:
            self._lines.clear()
        self._lines.append(truth)

    def error_m(self, pose: HandPose) -> float | None:
        """The largest distance of wrist and tips from the truth; None where that is not known."""
        after = bisect.bisect_left(self._lines, pose.stamp_ns, key=lambda line: line.stamp_ns)
        if not 0 < after < len(self._lines):
            return None
        before, behind = self._lines[after - 1], self._lines[after]
        if pose.hand not in before.hands or pose.hand not in behind.hands:
            return None
        share = (pose.stamp_ns - before.stamp_ns) / (behind.stamp_ns - before.stamp_ns)
        joints = {joint.name: joint.position_m for joint in pose.joints}
        return max(
            math.dist(joints[name], _between(a[name], b[name], share))
            for a, b in [(before.hands[pose.hand].points_m, behind.hands[pose.hand].points_m)]
            for name in _COMPARED
        )


def _between(a: Iterable[float], b: Iterable[float], share: float) -> list[float]:
    return [x + share * (y - x) for x, y in zip(a, b, strict=True)]


def _say(line: dict[str, object]) -> None:
    sys.stdout.buffer.write(msgspec.json.encode(line) + b"\n")
    sys.stdout.buffer.flush()


async def _poses(bus: Bus, track: TruthTrack) -> None:
    loop = asyncio.get_running_loop()

    def judge(pose: HandPose, line: dict[str, object]) -> None:
        _say({**line, "error_m": track.error_m(pose)})

    async for pose in bus.every(topics.POSE, 64):
        line: dict[str, object] = {
            "at_s": time.monotonic(),
            "age_s": (clock.now_ns() - pose.stamp_ns) * 1e-9,
            "measured": sum(joint.source == "measured" for joint in pose.joints),
        }
        loop.call_later(TRUTH_LATE_S, judge, pose, line)


async def _truth(bus: Bus, track: TruthTrack) -> None:
    async for truth in bus.every(topics.TRUTH, 64):
        track.add(truth)


async def _health(bus: Bus) -> None:
    async for health in bus.every(topics.HEALTH, 64):
        _say({"at_s": time.monotonic(), "health": health})


async def _watch(rig: str, endpoint: str) -> None:
    track = TruthTrack()
    async with open_bus(rig, [endpoint]) as bus, asyncio.TaskGroup() as tasks:
        for job in (_poses(bus, track), _truth(bus, track), _health(bus)):
            tasks.create_task(job)


def main() -> None:
    """Watch until killed."""
    assert set(_COMPARED) <= set(JOINTS)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rig", help="name of the rig")
    parser.add_argument("endpoint", help="where its router listens")
    options = parser.parse_args()
    asyncio.run(_watch(options.rig, options.endpoint))


if __name__ == "__main__":
    main()
