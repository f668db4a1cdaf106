"""The simulator as a service between a real router and a reader: pictures, poses and truth in real
time.
"""

from __future__ import annotations

import asyncio
import time

import cv2
import msgspec
import numpy as np
import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import ConfigError
from rhot.files.rig_tables import CameraTable, Objects
from rhot.messages.objects import OpenVrPose
from rhot.messages.simulator import SimFrame, Truth
from rhot.process.service import Service
from services.simulator.scene.scene import load_scene
from services.simulator.service import SceneClock, serve


async def collect(
    router: str, config, wanted: int
) -> tuple[Service, list, list[Truth], list[OpenVrPose]]:
    """Run the service until so many pictures, truths and poses each have come."""
    frames: list[tuple[SimFrame, bytes, int]] = []
    truths: list[Truth] = []
    poses: list[OpenVrPose] = []

    async def read(subscription, take) -> None:
        async for sample in subscription:
            if take(sample) >= wanted:
                return

    def frame(sample) -> int:
        frames.append(
            (
                msgspec.json.decode(sample.attachment, type=SimFrame),
                sample.payload,
                sample.received_ns,
            )
        )
        return len(frames)

    def append(to: list):
        return lambda message: to.append(message) or len(to)

    rig = config.rig.name
    async with (
        open_bus(rig, [router]) as theirs,
        open_bus(rig, [router]) as ours,
        asyncio.timeout(60.0),
        asyncio.TaskGroup() as tasks,
    ):
        service = Service("simulator", "main", config, theirs, tasks)
        readers = [
            tasks.create_task(read(ours.raw(topics.SIM_FRAME, 64), frame)),
            tasks.create_task(read(ours.every(topics.TRUTH, 64), append(truths))),
        ]
        if config.objects.source == "simulator":
            readers.append(tasks.create_task(read(ours.every(topics.OPENVR, 64), append(poses))))
        running = tasks.create_task(serve(service))
        await asyncio.gather(*readers)
        running.cancel()
    return service, frames, truths, poses


@pytest.fixture
def live(config):
    """The rig of config/sim.toml on this machine's clock."""
    return msgspec.structs.replace(
        config, simulator=msgspec.structs.replace(config.simulator, scene="still")
    )


async def test_pictures_truth_and_poses_come_in_real_time(router, live):
    before_ns = time.time_ns()
    service, frames, truths, poses = await collect(router, live, wanted=12)
    after_ns = time.time_ns()
    assert service.state == "running"
    scene = load_scene(live)
    assert {about.camera for about, _, _ in frames} == {"left", "right"}
    for about, payload, received_ns in frames:
        clock = scene.clocks[about.camera]
        assert len(payload) == 640 * 480 * 3 // 2
        assert about.row_time_ns == clock.row_time_ns
        # On the master's clock a picture is taken before it is there; the camera computer's clock
        # is milliseconds off.
        true_ns = about.stamp_ns - about.clock_skew_ns
        assert before_ns < true_ns < received_ns
        assert abs(about.clock_skew_ns - clock.offset_ns) < 1e6
    left = [about for about, _, _ in frames if about.camera == "left"]
    steps = np.diff([about.stamp_ns for about in left]) / np.diff([about.seq for about in left])
    np.testing.assert_allclose(steps, scene.clocks["left"].period_s * 1e9, atol=0.2e6)
    assert [t.stamp_ns for t in truths] == sorted({t.stamp_ns for t in truths})
    assert all(before_ns < t.stamp_ns < after_ns for t in truths)
    assert {p.device.serial for p in poses} == {"LHR-SIM00001"}
    assert all(before_ns < p.stamp_ns < after_ns for p in poses)
    bgr = cv2.cvtColor(
        np.frombuffer(frames[0][1], np.uint8).reshape(720, 640), cv2.COLOR_YUV2BGR_I420
    )
    assert bgr.std() > 20


async def test_other_sources_are_left_alone(router, live):
    cameras = [live.camera[0], CameraTable(name="right", source="v4l2:0")]
    rig = msgspec.structs.replace(live, camera=cameras, objects=Objects(source="steamvr"))
    _, frames, _, poses = await collect(router, rig, wanted=3)
    assert {about.camera for about, _, _ in frames} == {"left"}
    assert poses == []


async def test_an_unknown_scene_ends_the_service(router, live):
    wrong = msgspec.structs.replace(
        live, simulator=msgspec.structs.replace(live.simulator, scene="opera")
    )
    with pytest.raises(ExceptionGroup) as caught:
        await collect(router, wrong, wanted=1)
    assert caught.group_contains(ConfigError, match="no scene 'opera'")


async def test_missed_ticks_are_left_out(monkeypatch):
    clock = SceneClock()
    ticks = clock.ticks(0.01)
    number, due_s = await anext(ticks)
    assert (number, due_s) == (0, 0.0)
    # Somebody holds the loop for five periods: those are not made up for.
    now_s = clock.now_s()
    monkeypatch.setattr(clock, "_began_ns", clock._began_ns - 50_000_000)
    number, due_s = await anext(ticks)
    assert number >= 4
    assert due_s >= now_s + 0.03
    await ticks.aclose()
