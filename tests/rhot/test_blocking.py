"""The client without asyncio: loops, questions, errors, Ctrl-C; on a real router."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from itertools import islice

import pytest

import rhot
from rhot.errors import BusError
from testing.hand_stream import stream_hand

SECONDS = 60.0


@pytest.fixture
def streaming(router):
    """The endpoint of a router with a hand that moves."""
    loop = asyncio.new_event_loop()
    task = loop.create_task(stream_hand(router, SECONDS))
    thread = threading.Thread(target=lambda: loop.run_until_complete(_until_cancelled(task)))
    thread.start()
    yield router
    loop.call_soon_threadsafe(task.cancel)
    thread.join()
    loop.close()


async def _until_cancelled(task):
    await asyncio.wait([task])


@pytest.fixture
def ctrl_c():
    """Presses Ctrl-C half a second after its start."""
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    yield timer
    timer.cancel()


def test_poses_in_a_for_loop(streaming):
    with rhot.open(streaming) as rig:
        numbers = [pose.seq for pose in islice(rig.hand_poses("right", queue=64), 20)]
    assert numbers == sorted(set(numbers))


def test_questions_are_calls(streaming):
    with rhot.open(streaming) as rig:
        # The first question begins to follow the cup; what was before is not known.
        assert rig.object_at("cup", 1, timeout_s=SECONDS) is None
        poses = rig.hand_poses("right")
        places = (rig.object_at("cup", pose.stamp_ns) for pose in poses)
        assert next(filter(None, places)).object == "cup"
        assert rig.latest_pose("right", max_age_s=SECONDS) is not None
        assert rig.latest_pose("left", max_age_s=0.05) is None
        assert rig.session() is None
        assert rig.ask(rig.client.session()) is None


def test_grasps_begin_and_end(streaming):
    with rhot.open(streaming) as rig:
        events = list(islice(rig.grasps("cup"), 3))
    kinds = [event.kind for event in events]
    assert kinds in (["begin", "end", "begin"], ["end", "begin", "end"])


def test_a_stream_ends_with_the_block(streaming):
    with rhot.open(streaming) as rig:
        poses = rig.hand_poses("right")
        next(poses)
    with pytest.raises(StopIteration):
        next(poses)


def test_no_router_is_an_error_that_leaves_nothing_behind(endpoint):
    with pytest.raises(BusError, match="no router answers"), rhot.open(endpoint, timeout_s=0.3):
        pass
    assert "rhot" not in [thread.name for thread in threading.enumerate()]


def test_an_error_of_the_program_itself_passes(streaming):
    with pytest.raises(ZeroDivisionError), rhot.open(streaming) as rig:
        next(rig.hand_poses())
        raise ZeroDivisionError


def test_ctrl_c_ends_the_block_quietly_wherever_it_is(streaming, ctrl_c):
    reached = []
    with rhot.open(streaming) as rig:
        # Nobody sends a left hand: Ctrl-C comes while it waits.
        ctrl_c.start()
        for _ in rig.hand_poses("left"):
            pass
        reached.append("after the loop")
    assert not reached


def test_run_ends_an_asyncio_program_quietly(ctrl_c):
    async def forever():
        await asyncio.sleep(SECONDS)
        pytest.fail("Ctrl-C did not end it")

    ctrl_c.start()
    assert rhot.run(forever()) is None
