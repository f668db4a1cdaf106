"""Many questions, one piece of work."""

from __future__ import annotations

import asyncio

import pytest

from rhot.errors import RefusedError
from services.pi_tracker.endpoints.shared_answer import SharedAnswer


class Work:
    """Counts how often it is done."""

    def __init__(self):
        self.done = 0
        self.fails = False

    async def __call__(self):
        await asyncio.sleep(0.05)
        self.done += 1
        if self.fails:
            raise OSError("no")
        return self.done


async def test_who_asks_meanwhile_shares_the_answer():
    work = Work()
    shared = SharedAnswer(work, 0.0, 10)
    assert await asyncio.gather(*(shared.get() for _ in range(10))) == [1] * 10
    assert await shared.get() == 2


async def test_work_begins_no_sooner_than_a_while_after_the_last():
    loop, work = asyncio.get_running_loop(), Work()
    shared = SharedAnswer(work, 0.3, 10)
    began_s = loop.time()
    await shared.get()
    await shared.get()
    assert loop.time() - began_s >= 0.3


async def test_too_many_are_refused_and_the_others_answered():
    work = Work()
    shared = SharedAnswer(work, 0.0, 3)
    found = await asyncio.gather(*(shared.get() for _ in range(5)), return_exceptions=True)
    assert found[:3] == [1, 1, 1]
    assert all(isinstance(one, RefusedError) and one.code == "busy" for one in found[3:])


async def test_what_fails_fails_for_all_and_the_next_is_tried():
    work = Work()
    work.fails = True
    shared = SharedAnswer(work, 0.0, 10)
    found = await asyncio.gather(*(shared.get() for _ in range(3)), return_exceptions=True)
    assert [str(one) for one in found] == ["no"] * 3
    work.fails = False
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.01):
            await shared.get()
    assert await shared.get() == 2
