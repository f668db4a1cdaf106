"""Threads of a service do not interrupt its event loop."""

from __future__ import annotations

import subprocess
import sys

import pytest

# How each thread is scheduled: of the loop, of one that was there, and of one that came later.
POLICIES = """
import asyncio, os, threading
from rhot.process.threads.thread_turns import keep_the_turn
done = threading.Event()
def started():
    thread = threading.Thread(target=done.wait)
    thread.start()
    return thread.native_id
async def main():
    early = started()
    turn = asyncio.create_task(keep_the_turn())
    await asyncio.sleep(0.1)
    late = started()
    async with asyncio.timeout(10.0):
        while os.sched_getscheduler(late) != os.SCHED_BATCH:
            await asyncio.sleep(0.05)
    print(*(os.sched_getscheduler(thread) for thread in (0, early, late)), turn.done())
    done.set()
    turn.cancel()
asyncio.run(main())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone schedules threads as batches")
def test_the_loop_alone_may_interrupt_others():
    # A process of its own: the threads of this one are to stay as they are.
    ran = subprocess.run(
        [sys.executable, "-c", POLICIES], check=True, capture_output=True, text=True, timeout=60
    )
    other, batch = 0, 3
    assert ran.stdout.split() == [str(other), str(batch), str(batch), "False"]
