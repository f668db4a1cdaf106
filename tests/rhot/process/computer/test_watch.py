"""One service of a host tells of its computer, and another takes over when that one has gone."""

from __future__ import annotations

import asyncio

import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import RigTable
from rhot.process.computer import watch
from rhot.process.computer.watch import watch_computer
from testing.waiting import until


@pytest.fixture
def hot(tmp_path):
    """The root of a hot Pi."""
    zone = tmp_path / "sys/class/thermal/thermal_zone0"
    zone.mkdir(parents=True)
    (zone / "type").write_text("cpu-thermal\n")
    (zone / "temp").write_text("81000\n")
    return tmp_path


async def test_one_of_two_tells_and_the_other_takes_over(running, hot, monkeypatch):
    monkeypatch.setattr(watch, "_PERIOD_S", 0.05)

    async def serve(service):
        await asyncio.Event().wait()

    config = RigConfig(rig=RigTable(name="desk"), folder=str(hot))
    async with (
        running("fusion", serve, config) as (first, _),
        running("pi_tracker", serve, config) as (second, _),
    ):
        telling = asyncio.ensure_future(watch_computer(first, hot))
        await until(first.faults.standing)
        assert [fault.code for fault in first.faults.standing()] == ["computer_hot"]
        assert first.values["temperature_c"] == 81.0
        waiting = asyncio.ensure_future(watch_computer(second, hot))
        await asyncio.sleep(0.3)
        assert "temperature_c" not in second.values
        telling.cancel()
        await until(lambda: "temperature_c" in second.values)
        assert second.values["disk_free_mb"] > 0.0
        # The condition ends with what it told of.
        (hot / "sys/class/thermal/thermal_zone0/temp").write_text("60000\n")
        await until(lambda: not second.faults.standing())
        waiting.cancel()
