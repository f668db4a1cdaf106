from __future__ import annotations

import asyncio

import numpy as np
import pytest

import rhot
from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import BusError
from rhot.hand import JOINT_INDEX
from rhot.messages import HandPoint, HandPoints, Session
from rhot.messages.objects import ObjectPose
from testing.hand_stream import pose_at

DEADLINE_S = 60.0


async def test_five_lines_are_enough(router):
    async with open_bus("desk", [router]) as master, rhot.connect(router) as rig:
        publisher = master.publisher(topics.POINTS, hand="right")

        async def send():
            while True:
                publisher.put(HandPoints(hand="right", seq=4, stamp_ns=1, points=[]))
                await asyncio.sleep(0.01)

        task = asyncio.create_task(send())
        async with asyncio.timeout(DEADLINE_S):
            async for points in rig.hand_points("right"):
                assert points.seq == 4
                break
        task.cancel()


async def test_session_is_asked_for_and_set(router):
    async with open_bus("desk", [router]) as master, rhot.connect(router, rig="desk") as rig:
        heard = master.every(topics.SESSION, 4)
        master.answer(topics.SESSION, lambda: Session(running=True, start_ns=7))
        async with asyncio.timeout(DEADLINE_S):
            while (session := await rig.session()) is None:
                pass
            assert session.start_ns == 7
            rig.stop()
            assert not (await anext(heard)).running


async def test_no_master_no_session(router):
    async with rhot.connect(router) as rig:
        assert await rig.session() is None


async def test_an_object_at_the_instant_of_something_else(router):
    at_ns = 10**18

    def pose(ms):
        return ObjectPose(
            object="cup",
            serial="LHR-1",
            seq=ms,
            stamp_ns=at_ns + ms * 1_000_000,
            position_m=(ms * 1e-3, 0.0, 0.5),
            orientation_wxyz=(1.0, 0.0, 0.0, 0.0),
            velocity_m_s=(1.0, 0.0, 0.0),
            angular_velocity_rad_s=(0.0, 0.0, 0.0),
            tracking="ok",
            registered=True,
        )

    async with open_bus("desk", [router]) as tracker, rhot.connect(router) as rig:
        publisher = tracker.publisher(topics.OBJECT, object="cup")
        assert await rig.object_at("cup", at_ns, timeout_s=0.05) is None
        async with asyncio.timeout(DEADLINE_S):
            while not publisher.wanted:
                await asyncio.sleep(0.01)
            publisher.put(pose(0))
            publisher.put(pose(20))
            while (inside := await rig.object_at("cup", at_ns + 15_000_000)) is None:
                await asyncio.sleep(0.01)
            while (ahead := await rig.object_at("cup", at_ns + 50_000_000)) is None:
                await asyncio.sleep(0.01)
        assert inside.position_m[0] == pytest.approx(0.015)
        assert ahead.position_m[0] == pytest.approx(0.050)
        assert await rig.object_at("cup", at_ns + 200_000_000) is None


async def test_no_router_is_an_error_that_says_what_to_do(endpoint):
    with pytest.raises(BusError, match=r"no router answers at .*`rhot up` start one"):
        async with rhot.connect(endpoint, timeout_s=0.3):
            pass


async def test_a_hand_that_nobody_has_is_an_error_at_once(router):
    async with rhot.connect(router) as rig:
        with pytest.raises(ValueError, match="no hand 'middle'; give 'left', 'right'"):
            rig.hand_poses("middle")
        with pytest.raises(ValueError, match="no hand 'middle'"):
            rig.hand_points("middle")


async def test_the_latest_pose_is_there_at_once_and_never_an_old_one(router):
    async with open_bus("desk", [router]) as master, rhot.connect(router) as rig:
        assert await rig.latest_pose("right", max_age_s=0.05) is None
        publisher = master.publisher(topics.POSE, hand="right")
        async with asyncio.timeout(DEADLINE_S):
            while not publisher.wanted:
                await asyncio.sleep(0.01)
            while await rig.latest_pose("right", max_age_s=0.1) is None:
                publisher.put(pose_at(0.0, 1, 1))
            while (newest := await rig.latest_pose("right")) is None or newest.seq != 3:
                publisher.put(pose_at(0.5, 3, 3))
        await asyncio.sleep(0.2)
        assert await rig.latest_pose("right", max_age_s=0.1) is None
        kept = await rig.latest_pose("right", max_age_s=60.0)
        assert kept is not None
        assert kept.seq == newest.seq


def test_a_pose_by_names_and_as_arrays():
    pose = pose_at(0.5, 1, 1)
    assert pose.joint("index_tip") == pose.joints[JOINT_INDEX["index_tip"]]
    assert pose.finger("thumb").name == "thumb"
    assert pose.positions_m.shape == (26, 3)
    assert pose.orientations_wxyz.shape == (26, 4)
    assert pose.angles_rad[0, 1] == pose.finger("thumb").angles_rad.cmc > 0.0
    gap_m = pose.positions_m[JOINT_INDEX["thumb_tip"]] - pose.positions_m[JOINT_INDEX["index_tip"]]
    assert np.linalg.norm(gap_m) < 0.02
    with pytest.raises(ValueError, match="no joint 'index'; there are palm, wrist"):
        pose.joint("index")
    with pytest.raises(ValueError, match="no finger 'pinky'; there are thumb, index"):
        pose.finger("pinky")


def test_a_landmark_by_its_name():
    point = HandPoint(
        name="wrist",
        position_m=(0.0, 0.0, 0.5),
        sigma_m=(1e-3, 1e-3, 2e-3),
        cameras=["left"],
        source="measured",
    )
    points = HandPoints(hand="right", seq=1, stamp_ns=1, points=[point])
    assert points.point("wrist") is point
    assert points.point("index_tip") is None
