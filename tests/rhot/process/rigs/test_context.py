"""Whose words are whose."""

from __future__ import annotations

import asyncio

from rhot.process.rigs.context import enter, joined_status


async def test_the_status_names_each_rig_once_by_its_newest_name() -> None:
    async def serve(file: str, name: str, status: str) -> str:
        enter(file)
        joined_status("starting")
        enter(name)
        return joined_status(status)

    await asyncio.create_task(serve("a", "lab", "running"))
    said = await asyncio.create_task(serve("b", "desk", "not calibrated"))
    assert said == "lab: running; desk: not calibrated"
