"""Poses taken from a source; the real libsurvive, where it is installed."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from rhot.errors import SourceError
from rhot.messages.objects import OpenVrPose
from services.object_tracker.sources import PoseSource
from services.object_tracker.sources.survive_command import survive_command

Take = Callable[[PoseSource, int], Awaitable[list[OpenVrPose]]]


@pytest.fixture
def take() -> Take:
    """The first poses of a source, at most so many; fewer if it ends. A minute at most."""

    async def take_poses(source: PoseSource, count: int) -> list[OpenVrPose]:
        found: list[OpenVrPose] = []
        async with asyncio.timeout(60.0), contextlib.aclosing(source.poses()) as poses:
            async for pose in poses:
                found.append(pose)
                if len(found) >= count:
                    return found
        return found

    return take_poses


LIGHTHOUSES = """"v":"0",
"configed-lighthouse-gen":"2"
"lighthouse0":{
"index":"0",
"id":"1",
"mode":"0",
"pose":["-3","0","1","-0.70710678118","0","0.70710678118","0"],
"OOTXSet":"1",
"PositionSet":"1"
}
"lighthouse1":{
"index":"1",
"id":"2",
"mode":"1",
"pose":["3","0","1","0.70710678118","0","0.70710678118","0"],
"OOTXSet":"1",
"PositionSet":"1"
}
"""


@pytest.fixture
def simulated(tmp_path: Path) -> list[str]:
    """Arguments that have the real libsurvive simulate a tracker between two lighthouses.

    It needs them in its configuration: without, its simulator (1.1.21) crashes at once. Skips where
    libsurvive is not installed.
    """
    try:
        survive_command()
    except SourceError as error:
        pytest.skip(f"{error}")
    path = tmp_path / "lighthouses.json"
    path.write_text(LIGHTHOUSES)
    return ["--simulator", "--simulator-lh-gen", "2", "--configfile", str(path)]
