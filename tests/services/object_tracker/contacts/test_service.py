"""Contacts from the running object tracker, through a real router."""

from __future__ import annotations

import asyncio

import msgspec
import numpy as np
import pytest

import rhot
from rhot import topics
from rhot.errors import CalibrationError
from rhot.files.calibration import ObjectPlace, Objects, save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects as ObjectsTable
from rhot.files.rig_tables import ObjectTable, RigTable
from rhot.geometry.transforms import rotation_from_quaternion, transform
from services.object_tracker.service import serve


def rig(folder, **shape):
    save(
        folder / "calibration" / "objects.json",
        Objects(
            date="2026-01-01",
            tool="test",
            T_rig_from_lighthouse=tuple(tuple(row) for row in np.eye(4).tolist()),
            objects={"cup": ObjectPlace()},
        ),
    )
    return RigConfig(
        rig=RigTable(name="desk"),
        object=[ObjectTable(name="cup", serial="LHR-1", **shape)],
        objects=ObjectsTable(source="network"),
        folder=str(folder),
    )


async def test_a_grasp_arrives_as_an_event(running, router, recorded, make_pose, sending, tmp_path):
    scene, recording = recorded(seed=1)
    size = (scene.setting.diameter_m, scene.setting.height_m)
    config = rig(tmp_path, shape="cylinder", size_m=size)
    hand = next(one for one in recording.hands if one.stamp_ns > 10**18 + 2.6e9)
    cup = min(recording.objects, key=lambda one: abs(one.stamp_ns - hand.stamp_ns))
    T = transform(rotation_from_quaternion(cup.orientation_wxyz), cup.position_m)
    async with (
        running("object_tracker", serve, config) as (_, bus),
        rhot.connect(router, "desk") as client,
    ):
        hands = bus.publisher(topics.POSE, hand="right")
        cups = bus.publisher(topics.OPENVR, serial="LHR-1")
        frame = 0

        def send():
            nonlocal frame
            frame += 1
            stamp_ns = 10**18 + frame * 33_000_000
            cups.put(make_pose(T, stamp_ns=stamp_ns - 1_000_000, seq=frame))
            hands.put(msgspec.structs.replace(hand, stamp_ns=stamp_ns, seq=frame))

        touches, grasps = client.touches("cup"), client.grasps()
        with sending(send):
            touch = await anext(touches)
            begun = await anext(grasps)
        assert (touch.kind, touch.object, touch.hand) == ("begin", "cup", "right")
        assert (begun.kind, begun.object, begun.hand) == ("begin", "cup", "right")
        assert {"thumb"} < set(begun.parts)
        # The hand sends nothing any more.
        ended = await anext(grasps)
        assert (ended.kind, ended.object) == ("end", "cup")
        assert ended.stamp_ns > begun.stamp_ns


async def test_a_mesh_that_is_missing_ends_the_service(running, tmp_path):
    with pytest.RaisesGroup(CalibrationError):
        async with running("object_tracker", serve, rig(tmp_path, shape="mesh", mesh="none.glb")):
            await asyncio.Event().wait()
