"""Changes that come faster than they may be written: the newest is made, and all are answered."""

from __future__ import annotations

import asyncio
import os
import time

import pytest

from rhot.errors import RefusedError
from rhot.files.calibration import Exposure, load_exposure
from services.pi_tracker.endpoints import latest_change
from services.pi_tracker.endpoints.latest_change import LatestChange, write_setting


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """A period that a test can wait for."""
    monkeypatch.setattr(latest_change, "_PERIOD_S", 0.2)


async def test_the_first_is_made_at_once_and_of_the_rest_the_newest():
    made = []

    async def apply(wanted):
        made.append(wanted)

    changes = LatestChange(apply)
    await changes.make(0)
    assert made == [0]
    await asyncio.gather(*(changes.make(n) for n in range(1, 10)))
    assert made == [0, 9]
    await changes.make(10)
    assert made == [0, 9, 10]


async def test_wishes_can_be_merged():
    made = []

    async def apply(wanted):
        made.append(wanted)

    changes = LatestChange(apply, lambda earlier, later: earlier | later)
    await changes.make({})
    await asyncio.gather(changes.make({"gain": 2}), changes.make({"exposure": 3}))
    assert made == [{}, {"gain": 2, "exposure": 3}]


async def test_what_fails_fails_for_all_who_waited_and_for_nobody_else():
    async def apply(wanted):
        if wanted == "bad":
            raise RefusedError("no", "invalid")

    changes = LatestChange(apply)
    await changes.make("good")
    found = await asyncio.gather(*(changes.make("bad") for _ in range(3)), return_exceptions=True)
    assert [str(error) for error in found] == ["no"] * 3
    await changes.make("good")


async def test_only_so_many_may_wait(monkeypatch):
    monkeypatch.setattr(latest_change, "_MOST_WAITING", 32)
    began = asyncio.Event()

    async def apply(wanted):
        await began.wait()

    changes = LatestChange(apply)
    waiting = [asyncio.ensure_future(changes.make(n)) for n in range(32)]
    await asyncio.sleep(0)
    with pytest.raises(RefusedError, match="wait already") as caught:
        await changes.make(33)
    assert caught.value.code == "busy"
    began.set()
    async with asyncio.timeout(60.0):
        await asyncio.gather(*waiting)


async def test_a_leader_that_goes_away_leaves_no_change_behind():
    made = []

    async def apply(wanted):
        made.append(wanted)

    changes = LatestChange(apply)
    await changes.make(0)
    leader = asyncio.ensure_future(changes.make(1))
    await asyncio.sleep(0.05)
    leader.cancel()
    await asyncio.wait([leader])
    await changes.make(2)
    assert made == [0, 2]


def test_what_was_in_use_for_a_while_is_kept(tmp_path):
    path = tmp_path / "calibration" / "left.exposure.json"

    def exposure(us):
        return Exposure(exposure_us=us, gain=1.0, red_gain=1.0, blue_gain=1.0)

    write_setting(path, exposure(1.0))
    write_setting(path, exposure(2.0))
    backup = path.with_name("left.exposure.json.bak")
    # What was replaced at once was a trial.
    assert not backup.exists()
    os.utime(path, (time.time() - 120.0, time.time() - 120.0))
    for us in (3.0, 4.0, 5.0):
        write_setting(path, exposure(us))
    assert load_exposure(path.parent, "left").exposure_us == 5.0
    backup.replace(path)
    assert load_exposure(path.parent, "left").exposure_us == 2.0
    assert [one.name for one in path.parent.iterdir()] == ["left.exposure.json"]
