"""The running object tracker with a real router, a publisher of poses and a reader of objects."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot import topics
from rhot.errors import SourceError
from rhot.files.calibration import Objects as Registered
from rhot.files.calibration import save
from rhot.files.capture import write_lines
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects, ObjectTable, RigTable
from rhot.geometry.transforms import transform
from rhot.messages.objects import OpenVrEvent, OpenVrPose
from rhot.process.service import Service
from services.object_tracker.service import serve

MakePose = Callable[..., OpenVrPose]


def rig(folder: Path, source: str) -> RigConfig:
    return RigConfig(
        rig=RigTable(name="desk"),
        object=[ObjectTable(name="cup", serial="LHR-1")],
        objects=Objects(source=source),
        folder=str(folder),
    )


async def test_poses_in_objects_out_with_garbage_between(
    running: Callable, tmp_path: Path, make_pose: MakePose, sending: Callable
) -> None:
    async with running("object_tracker", serve, rig(tmp_path, "network")) as (service, bus):
        known, unknown = (
            bus.publisher(topics.OPENVR, serial=serial) for serial in ("LHR-1", "LHR-2")
        )

        def send() -> None:
            for payload in (
                b"\xff\x00",
                b"[]",
                b"{}",
                b'{"v": null}',
                msgspec.json.encode(make_pose(serial="LHR-9")),
            ):
                bus.put_raw("rhot/desk/openvr/LHR-1/pose", payload)
            unknown.put(make_pose(serial="LHR-2"))
            at_ns = time.time_ns()
            T = transform(np.eye(3), [0.1, 0.2, 0.3])
            known.put(make_pose(T, stamp_ns=at_ns, seq=at_ns))

        objects = bus.every(topics.OBJECT, 8)
        with sending(send):
            # Poses overtake the garbage, which travels at a lower priority.
            while (
                sum(stats.rejected for stats in service.bus.streams) < 5
                or service.values["unknown"] < 1
            ):
                result = await anext(objects)
        assert (result.object, result.position_m, result.tracking, result.registered) == (
            "cup",
            (0.1, 0.2, 0.3),
            "unregistered",
            False,
        )
        assert service.state == "running"
        while "LHR-2" not in {fault.subject for fault in service.faults.standing()}:
            await asyncio.sleep(0.05)
        texts = {fault.code: fault.text for fault in service.faults.standing()}
        assert texts.keys() == {"object_unregistered", "device_unknown"}
        assert "poses of cup stay" in texts["object_unregistered"]


async def test_a_moved_universe_and_a_device_that_stops(
    running: Callable, tmp_path: Path, make_pose: MakePose
) -> None:
    same_frame = msgspec.convert({"T_rig_from_lighthouse": np.eye(4).tolist()}, Registered)
    save(tmp_path / "calibration" / "objects.json", same_frame)
    async with running("object_tracker", serve, rig(tmp_path, "network")) as (service, bus):
        poses = bus.publisher(topics.OPENVR, serial="LHR-1")
        events = bus.publisher(topics.OPENVR_EVENT, host="pc")
        objects = bus.every(topics.OBJECT, 64)
        while not (poses.wanted and events.wanted):
            await asyncio.sleep(0.05)

        async def until(tracking: str) -> None:
            """Send on until an object's pose says so."""
            while True:
                poses.put(make_pose(stamp_ns=time.time_ns(), seq=time.time_ns()))
                if (await anext(objects)).tracking == tracking:
                    return

        await until("ok")
        # It is told as lost, and as nothing else, until it is back.
        assert [(await anext(objects)).tracking for _ in range(2)] == ["lost", "lost"]
        await until("ok")
        events.put(
            OpenVrEvent(
                v=1, stamp_ns=time.time_ns(), event_type=801, name="ChaperoneUniverseHasChanged"
            )
        )
        await until("unregistered")
        while service.values["registered"]:
            await asyncio.sleep(0.05)
        assert [fault.code for fault in service.faults.standing()] == ["registration_stale"]


async def test_a_source_feeds_the_bus(
    running: Callable, tmp_path: Path, make_pose: MakePose
) -> None:
    write_lines(
        tmp_path / "o.jsonl",
        [make_pose(stamp_ns=10**18 + i * 5_000_000, seq=i) for i in range(400)],
    )
    async with running("object_tracker", serve, rig(tmp_path, "replay:o.jsonl")) as (_, bus):
        raw = bus.every(topics.OPENVR, 8)
        result = await anext(bus.every(topics.OBJECT, 8))
        assert result.stamp_ns == 10**18 + result.seq * 5_000_000
        assert (await anext(raw)).device.serial == "LHR-1"


async def test_a_source_that_fails_is_tried_again(
    running: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, vive: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")

    def lost(service: Service) -> list[str]:
        return [f.text for f in service.faults.standing() if f.code == "source_lost"]

    command = tmp_path / "survive-cli"
    command.write_text("#!/bin/sh\necho no access to USB >&2\nexit 3\n")
    command.chmod(0o755)
    async with running("object_tracker", serve, rig(tmp_path, "libsurvive")) as (service, _):
        while not lost(service):
            await asyncio.sleep(0.05)
        assert "ended with exit code 3; it said: no access to USB" in lost(service)[0]
        assert service.state == "running"
        # It is mended, and its first poses end the fault.
        command.write_text(
            f"#!/bin/sh\nzcat {vive}/libsurvive/tracker-cal-attempt.rec.gz\nexec sleep 60\n"
        )
        while lost(service):
            await asyncio.sleep(0.05)


async def test_an_unknown_source_ends_the_service(running: Callable, tmp_path: Path) -> None:
    with pytest.RaisesGroup(SourceError):
        async with running("object_tracker", serve, rig(tmp_path, "lighthouse")):
            await asyncio.Event().wait()
