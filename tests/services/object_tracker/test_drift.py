"""The running object tracker tells that a base station was moved: messages, a real router."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.files.calibration import CameraPlace, Lens, ObjectPlace, Objects, RigGeometry, save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, ObjectTable, RigTable
from rhot.files.rig_tables import Objects as ObjectsTable
from rhot.geometry.transforms import Array, rotation_y, transform
from rhot.process.service import Service
from services.object_tracker.service import serve
from testing.painted_tracker import MARKER_M, PaintedTracker, rows_of
from testing.synthetic_points import START_NS


@pytest.fixture
def config(tmp_path: Path) -> RigConfig:
    """A rig whose cup carries paint, calibrated and registered."""
    scene = PaintedTracker()
    cameras = scene.cameras()
    folder = tmp_path / "calibration"
    places = {
        n: CameraPlace(T_rig_from_camera=rows_of(c.T_rig_from_camera)) for n, c in cameras.items()
    }
    save(folder / "rig.json", RigGeometry(cameras=places))
    for name, camera in cameras.items():
        lens = Lens(
            size_px=camera.size_px,
            matrix=rows_of(camera.matrix),
            distortion=tuple(camera.distortion.tolist()),
        )
        save(folder / f"{name}.lens.json", lens)
    place = ObjectPlace(marker_m=MARKER_M)
    registered = Objects(
        T_rig_from_lighthouse=rows_of(scene.T_rig_from_lighthouse), objects={"cup": place}
    )
    save(folder / "objects.json", registered)
    return RigConfig(
        rig=RigTable(name="desk"),
        camera=[CameraTable(name=name, source="simulator") for name in cameras],
        object=[ObjectTable(name="cup", serial="LHR-1", marker="orange")],
        objects=ObjectsTable(source="network"),
        folder=str(tmp_path),
    )


async def test_a_moved_base_station_is_named_and_its_return_too(
    running: Callable, config: RigConfig
) -> None:
    async with running("object_tracker", serve, config) as (service, bus):
        scene = PaintedTracker(seconds=600.0)
        moved = transform(rotation_y(np.deg2rad(0.5)), (0.003, 0.004, 0.0))
        truth = asyncio.create_task(_play(bus, scene, None))
        while "drift_mm" not in service.values:
            await asyncio.sleep(0.1)
        await asyncio.sleep(3.0)
        assert not _drift(service)
        truth.cancel()
        bumped = asyncio.create_task(_play(bus, scene, moved))
        while not (texts := _drift(service)):
            await asyncio.sleep(0.1)
        assert texts[0].startswith("cup: the orange paint is ")
        assert "mm from where its pose puts it" in texts[0]
        bumped.cancel()
        again = asyncio.create_task(_play(bus, scene, None))
        while _drift(service):
            await asyncio.sleep(0.1)
        again.cancel()


async def test_without_paint_that_is_known_nothing_is_listened_to(
    running: Callable, config: RigConfig
) -> None:
    unknown = msgspec.structs.replace(
        config, object=[ObjectTable(name="cup", serial="LHR-1", marker=None)]
    )
    async with running("object_tracker", serve, unknown) as (service, _):
        while service.state != "running":
            await asyncio.sleep(0.02)
        assert not [one for one in service.bus.streams if one.topic is topics.MARKERS]


def _drift(service: Service) -> list[str]:
    return [one.text for one in service.faults.standing() if one.code == "registration_drift"]


async def _play(bus: Bus, scene: PaintedTracker, moved: Array | None) -> None:
    """Poses and pictures at their own pace, by this computer's clock."""
    poses = bus.publisher(topics.OPENVR, serial=scene.serial)
    frames = {name: bus.publisher(topics.MARKERS, camera=name) for name in scene.cameras()}
    began_ns = clock.now_ns()
    # In slices: the beginning of the scene is wherever the clock is.
    for second in range(int(scene.seconds)):
        slice_s = replace(scene, seconds=1.0)
        due = [(pose.stamp_ns, 0, pose) for pose in slice_s.poses(float(second), moved)]
        due += [(frame.stamp_ns + 40_000_000, 1, frame) for frame in slice_s.frames(float(second))]
        due.sort(key=lambda one: one[:2])
        for at_ns, kind, message in due:
            await asyncio.sleep(max(at_ns - START_NS + began_ns - clock.now_ns(), 0) * 1e-9)
            late = {"stamp_ns": message.stamp_ns - START_NS + began_ns}
            shown = msgspec.structs.replace(message, **late)
            (frames[message.camera] if kind else poses).put(shown)
