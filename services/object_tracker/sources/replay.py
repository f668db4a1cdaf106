"""Poses from an objects.jsonl, in real time and with their original stamps; ends with the file.

A missing or broken file raises CaptureError with the line's number. Stamps that run backwards are
sent at once.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from pathlib import Path

from rhot.files.capture import read_lines
from rhot.messages.objects import OpenVrPose

# A longer gap is a pause of the recording, or a broken stamp: it is shortened to this.
_LONGEST_GAP_NS = 5_000_000_000


class Replay:
    """The poses of one file."""

    def __init__(self, path: Path) -> None:
        self._path = path

    async def poses(self) -> AsyncGenerator[OpenVrPose]:
        """Every line of the file, at the time of its stamp."""
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        last_ns: int | None = None
        for pose in read_lines(self._path, OpenVrPose):
            gap_ns = 0 if last_ns is None else pose.stamp_ns - last_ns
            last_ns = pose.stamp_ns
            due_s += min(max(gap_ns, 0), _LONGEST_GAP_NS) * 1e-9
            await asyncio.sleep(max(0.0, due_s - loop.time()))
            yield pose
