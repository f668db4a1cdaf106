"""Whose words are whose."""

from __future__ import annotations

import asyncio

from rhot.process.rigs.context import SERVICE, enter, joined_status


async def test_the_status_names_each_rig_once_by_its_newest_name() -> None:
    async def serve(file: str, name: str, status: str) -> str:
        enter(file)
        joined_status("starting")
        enter(name)
        return joined_status(status)

    await asyncio.create_task(serve("a", "lab", "running"))
    said = await asyncio.create_task(serve("b", "desk", "not calibrated"))
    assert said == "lab: running; desk: not calibrated"


async def test_the_status_names_the_service_beside_the_processes_own() -> None:
    async def serve(service: str, status: str) -> str:
        enter("attic")
        SERVICE.set(service)
        return joined_status(status)

    await asyncio.create_task(serve("", "running"))
    said = await asyncio.create_task(serve("solver", "starting"))
    assert said.endswith("attic: running; solver attic: starting")
