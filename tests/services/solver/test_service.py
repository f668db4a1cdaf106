"""The running solver between a real router, a publisher of points and a reader of poses."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import msgspec
import pytest

from rhot import topics
from rhot.bus.bus import Bus, Subscription, open_bus
from rhot.errors import CalibrationError, ConfigError
from rhot.files.calibration import save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import HandTable, RigTable
from rhot.hand import default_hand
from rhot.messages import HandPoints, HandPose
from rhot.process.service import Service
from services.solver.service import serve

MARKERS = HandTable(markers={"wrist": "violet"})


@contextlib.asynccontextmanager
async def running(router: str, config: RigConfig) -> AsyncIterator[tuple[Service, Bus]]:
    """The service in this process, and a bus of our own."""
    async with (
        open_bus("desk", [router]) as theirs,
        open_bus("desk", [router]) as ours,
        asyncio.timeout(60.0),
        asyncio.TaskGroup() as tasks,
    ):
        service = Service("solver", "main", config, theirs, tasks)
        task = tasks.create_task(serve(service))
        yield service, ours
        task.cancel()


def rig(folder: Path, *hands: str) -> RigConfig:
    return RigConfig(
        rig=RigTable(name="desk"), hand=dict.fromkeys(hands, MARKERS), folder=str(folder)
    )


async def _sending(send: Callable[[], None]) -> None:
    """Send again and again: subscriptions need a moment to reach the router."""
    while True:
        send()
        await asyncio.sleep(0.02)


async def test_points_in_poses_out_with_garbage_between(
    router: str, tmp_path: Path, world: Callable
) -> None:
    right, left = world("right"), world("left")
    good = right.message(right.points(right.motion(1, 1)[0]), 0)
    other = left.message(left.points(left.motion(1, 1)[0]), 0)
    async with running(router, rig(tmp_path, "right", "left")) as (service, bus):
        points = {hand: bus.publisher(topics.POINTS, hand=hand) for hand in ("right", "left")}
        poses = {hand: bus.every(topics.POSE, 8, hand=hand) for hand in ("right", "left")}
        count = 0

        def send() -> None:
            nonlocal count
            count += 1
            # Few may wait, whatever they are: each kind gets a moment of its own.
            kind = count % 3
            if kind == 0:
                bus.put_raw(
                    "rhot/desk/hand/right/points",
                    (b"\xff\x00", b"[]", b'{"hand": "right"}')[count // 3 % 3],
                )
                return
            # The right hand's key also carries points of the left one: rejected too.
            for hand, message in (("right", (good, other)[kind - 1]), ("left", other)):
                points[hand].put(
                    msgspec.structs.replace(
                        message, seq=count, stamp_ns=10**18 + count * 20_000_000
                    )
                )

        sender = asyncio.create_task(_sending(send))
        pose, mirrored = await anext(poses["right"]), await anext(poses["left"])
        while sum(stats.rejected for stats in service.bus.streams) < 9:
            await anext(poses["right"])
        sender.cancel()
        assert (pose.hand, mirrored.hand) == ("right", "left")
        assert {finger.status for finger in pose.fingers} == {"solved"}
        assert service.state == "running"
        assert service.values["right_from_tables"] == 1.0
        assert service.values["right_solve_ms"] > 0.0
        assert 0.9 < service.values["right_size"] < 1.1


async def test_points_that_come_at_once_have_their_poses(
    router: str, tmp_path: Path, world: Callable
) -> None:
    """As from a fusion that something held up: the first of 17 is skipped."""
    ours = world("right")
    message = ours.message(ours.points(ours.motion(1, 1)[0]), 0)

    def numbered(seq: int) -> HandPoints:
        return msgspec.structs.replace(message, seq=seq, stamp_ns=10**18 + seq * 20_000_000)

    async with running(router, rig(tmp_path, "right")) as (_, bus):
        points, poses = bus.publisher(topics.POINTS, hand="right"), bus.every(topics.POSE, 32)
        sent = 0

        def send() -> None:
            nonlocal sent
            sent += 1
            points.put(numbered(sent))

        def send_at_once() -> None:
            """The solver shares this event loop: all of them come before it can take one."""
            for seq in range(1001, 1018):
                points.put(numbered(seq))
            time.sleep(0.5)

        sender = asyncio.create_task(_sending(send))
        await anext(poses)
        sender.cancel()
        await asyncio.sleep(0.2)
        send_at_once()
        told = [seq async for seq in _seqs(poses, 1017)]
    assert [seq for seq in told if seq > 1000] == list(range(1002, 1018))


async def _seqs(poses: Subscription[HandPose], last: int) -> AsyncIterator[int]:
    async for pose in poses:
        yield pose.seq
        if pose.seq >= last:
            return


async def test_a_measured_hand_is_used(router: str, tmp_path: Path) -> None:
    save(
        tmp_path / "calibration" / "hand.right.json",
        msgspec.structs.replace(default_hand("right", 1.1), origin="measured"),
    )
    async with running(router, rig(tmp_path, "right")) as (service, _):
        while service.state != "running":
            await asyncio.sleep(0.01)
        assert service.values == {"right_from_tables": 0.0}


@pytest.mark.parametrize("broken", ["no hand", "no paint"])
async def test_what_the_user_can_mend_ends_the_service(
    router: str, tmp_path: Path, broken: str
) -> None:
    hands = ("right",) if broken == "no paint" else ()
    save(
        tmp_path / "calibration" / "hand.right.json",
        msgspec.structs.replace(default_hand(), paint={}),
    )
    with pytest.RaisesGroup(pytest.RaisesExc(CalibrationError if hands else ConfigError)):
        async with running(router, rig(tmp_path, *hands)) as (service, _):
            while service.state != "running":
                await asyncio.sleep(0.01)
