"""Faults of a running rig are named in time, in health and in the journal, and end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio

from rhot import topics
from rhot.messages.health import Fault, Health

pytestmark = [pytest.mark.field, pytest.mark.asyncio(loop_scope="module")]

START_S = 180.0
# A hue that nothing in the scene has, and no picture's noise reaches.
NOWHERE = {"hsv_low": [2, 250, 250], "hsv_high": [4, 255, 255]}


class Watch:
    """The newest health of each service of each session: two of a name are two."""

    def __init__(self) -> None:
        self.healths: dict[tuple[str, str], Health] = {}

    async def follow(self, bus) -> None:
        async for health in bus.every(topics.HEALTH, 256):
            self.healths[health.session, health.service] = health

    def faults(self, service: str, code: str) -> list[Fault]:
        return [
            fault
            for health in self.healths.values()
            if health.service == service
            for fault in health.faults
            if fault.code == code
        ]


@pytest_asyncio.fixture(loop_scope="module")
async def watch(rig) -> AsyncIterator[Watch]:
    found = Watch()
    task = asyncio.create_task(found.follow(rig.bus))
    await rig.until(lambda: {h.service for h in found.healths.values()} >= {"fusion", "solver"})
    yield found
    task.cancel()


async def test_a_wrong_range_is_named_within_ten_seconds(rig, watch):
    path = rig.config.parent / "calibration" / "left.colors.json"
    right_one = path.read_bytes()
    # All is well for a while, whatever the hand does.
    await asyncio.sleep(3.0)
    assert not watch.faults("fusion", "marker_not_seen")
    wrong = json.loads(right_one)
    wrong["colors"]["lime"] = NOWHERE
    path.write_text(json.dumps(wrong))
    began_s = asyncio.get_running_loop().time()
    await rig.until(lambda: watch.faults("fusion", "marker_not_seen"), 30.0)
    took_s = asyncio.get_running_loop().time() - began_s
    (fault,) = watch.faults("fusion", "marker_not_seen")
    assert fault.subject == "lime"
    assert fault.text.startswith("lime (little tip): not seen by left for ")
    assert fault.text.endswith("; right sees it")
    assert "`rhot calibrate colors left`" in fault.action
    assert any("lime (little tip)" in line and "[fusion]" in line for line in rig.logged)
    path.write_bytes(right_one)
    await rig.until(lambda: not watch.faults("fusion", "marker_not_seen"), 30.0)
    assert took_s < 10.0


@contextlib.asynccontextmanager
async def second_fusion(rig) -> AsyncIterator[None]:
    process = await asyncio.create_subprocess_exec(
        str(Path(sys.executable).parent / "rhot-fusion"),
        *("--config", str(rig.config), "--connect", rig.endpoint),
        stdout=asyncio.subprocess.DEVNULL,
        env={**os.environ},
    )
    try:
        yield
    finally:
        process.terminate()
        async with asyncio.timeout(60.0):
            await process.wait()


async def test_a_second_fusion_is_named_by_both_until_it_is_gone(rig, watch):
    async with second_fusion(rig):
        await rig.until(lambda: len(watch.faults("fusion", "second_service")) == 2, START_S)
        texts = [fault.text for fault in watch.faults("fusion", "second_service")]
        assert sorted(text.rsplit("; ")[-1] for text in texts) == [
            "it came later",
            "it was there first",
        ]
        await rig.until(lambda: watch.faults("pi_tracker", "second_clock"))
        assert "2 services answer" in watch.faults("pi_tracker", "second_clock")[0].text
        await rig.until(lambda: len(watch.faults("fusion", "second_clock")) == 2)
    # The last word of the second is no news of it.
    for key, health in list(watch.healths.items()):
        if health.service == "fusion" and health.uptime_s < max(
            h.uptime_s for h in watch.healths.values() if h.service == "fusion"
        ):
            del watch.healths[key]
    await rig.until(lambda: not watch.faults("fusion", "second_service"))
    await rig.until(lambda: not watch.faults("pi_tracker", "second_clock"))
    await rig.until(lambda: not watch.faults("fusion", "second_clock"))
