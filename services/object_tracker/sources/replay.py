"""Poses from a recording of any known kind (services/object_tracker/recorded/), in real time; ends
with the file.

Stamps are the recording's own where it has dates and is played once, as it was; else poses are
stamped as if they were recorded now. Stamps that run backwards are sent at once. A missing or
broken file raises CaptureError with the line's number.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import AsyncGenerator, Iterator
from pathlib import Path

import msgspec

from rhot import clock
from rhot.messages.objects import OpenVrPose
from services.object_tracker.recorded.recording import UNNAMED, kind_of, read_poses

# A longer gap is a pause of the recording, or a broken stamp: it is shortened to this.
_LONGEST_GAP_NS = 5_000_000_000
# 2001-09-09. Recordings without dates count from their start.
_LEAST_DATE_NS = 10**18
# Read at a time, in a thread: a recording of libsurvive has 30 s of other lines before its first
# pose.
_AT_ONCE = 64
# Between the rounds of a loop: SteamVR's 100 Hz.
_STEP_S = 0.01


class Replay:
    """The poses of one recording.

    serial is for devices that it does not name; speed 2 plays it in half its time; loop begins it
    anew when it ends.
    """

    def __init__(
        self, path: Path, serial: str = UNNAMED, *, speed: float = 1.0, loop: bool = False
    ) -> None:
        self._path = path
        self._serial = serial
        self._speed = speed
        self._loop = loop

    async def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Every pose of the recording, when its time has come."""
        loop = asyncio.get_running_loop()
        kind = await asyncio.to_thread(kind_of, self._path)
        own_stamps = self._speed == 1.0 and not self._loop
        seq = itertools.count()
        began_ns, began_s = clock.now_ns(), loop.time()
        due_s = began_s
        while True:
            poses = read_poses(self._path, self._serial)
            last_ns: int | None = None
            while batch := await asyncio.to_thread(_some, poses):
                for pose in batch:
                    gap_ns = 0 if last_ns is None else pose.stamp_ns - last_ns
                    last_ns = pose.stamp_ns
                    due_s += min(max(gap_ns, 0), _LONGEST_GAP_NS) * 1e-9 / self._speed
                    await asyncio.sleep(max(0.0, due_s - loop.time()))
                    if own_stamps and (kind == "messages" or pose.stamp_ns >= _LEAST_DATE_NS):
                        yield pose
                    else:
                        stamp_ns = began_ns + round((due_s - began_s) * 1e9)
                        yield self._now(pose, next(seq), stamp_ns)
            if not self._loop:
                return
            # The next round's first pose is one step after this one's last.
            due_s += _STEP_S

    def _now(self, pose: OpenVrPose, seq: int, stamp_ns: int) -> OpenVrPose:
        """The same pose as of now, as fast as it is played."""
        vx, vy, vz = pose.vVelocity
        wx, wy, wz = pose.vAngularVelocity
        k = self._speed
        return msgspec.structs.replace(
            pose,
            seq=seq,
            stamp_ns=stamp_ns,
            clock_offset_ns=0,
            vVelocity=(k * vx, k * vy, k * vz),
            vAngularVelocity=(k * wx, k * wy, k * wz),
        )


def _some(poses: Iterator[OpenVrPose]) -> list[OpenVrPose]:
    return list(itertools.islice(poses, _AT_ONCE))
