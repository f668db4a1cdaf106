"""The running object tracker tells that a base station was moved: messages, a real router."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot import clock, topics
from rhot.files.calibration import ObjectPlace, Objects, save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, ObjectTable, RigTable
from rhot.files.rig_tables import Objects as ObjectsTable
from rhot.geometry.transforms import rotation_y, transform
from rhot.process.service import Service
from services.object_tracker.service import serve
from testing.painted_tracker import MARKER_M, PaintedTracker, play, rows_of, write_cameras


@pytest.fixture
def config(tmp_path: Path) -> RigConfig:
    """A rig whose cup carries paint, calibrated and registered."""
    scene = PaintedTracker()
    folder = tmp_path / "calibration"
    write_cameras(scene, folder)
    place = ObjectPlace(marker_m=MARKER_M)
    registered = Objects(
        T_rig_from_lighthouse=rows_of(scene.T_rig_from_lighthouse), objects={"cup": place}
    )
    save(folder / "objects.json", registered)
    return RigConfig(
        rig=RigTable(name="desk"),
        camera=[CameraTable(name=name, source="simulator") for name in scene.cameras()],
        object=[ObjectTable(name="cup", serial="LHR-1", marker="orange")],
        objects=ObjectsTable(source="network"),
        folder=str(tmp_path),
    )


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A window of three seconds, looked at three times a second, so that tests are short; what the
    real one tells apart is for tests/services/object_tracker/monitors/.
    """
    monkeypatch.setattr("services.object_tracker.drift._LOOK_S", 0.3)
    monkeypatch.setattr("services.object_tracker.monitors.drift_watch._WINDOW_S", 3.0)


async def test_a_moved_base_station_is_named_and_its_return_too(
    running: Callable, config: RigConfig
) -> None:
    async with running("object_tracker", serve, config) as (service, bus):
        scene = PaintedTracker(seconds=600.0)
        moved = transform(rotation_y(np.deg2rad(0.5)), (0.003, 0.004, 0.0))
        truth = asyncio.create_task(play(bus, scene, None))
        while "drift_mm" not in service.values:
            await asyncio.sleep(0.1)
        await asyncio.sleep(1.0)
        assert not _drift(service)
        truth.cancel()
        bumped = asyncio.create_task(play(bus, scene, moved))
        while not (texts := _drift(service)):
            await asyncio.sleep(0.1)
        assert texts[0].startswith("cup: the orange paint is ")
        assert "mm from where its pose puts it" in texts[0]
        bumped.cancel()
        again = asyncio.create_task(play(bus, scene, None))
        while _drift(service):
            await asyncio.sleep(0.1)
        again.cancel()


async def test_poses_are_corrected_if_rig_toml_asks_for_it(
    running: Callable, config: RigConfig
) -> None:
    table = ObjectsTable(source="network", drift="correct")
    asking = msgspec.structs.replace(config, objects=table)
    written = (config.calibration_dir / "objects.json").read_bytes()
    async with running("object_tracker", serve, asking) as (service, bus):
        scene = PaintedTracker(seconds=600.0, outliers=0.0)
        moved = transform(rotation_y(np.deg2rad(0.5)), (0.003, 0.004, 0.0))
        began_ns = clock.now_ns()
        player = asyncio.create_task(play(bus, scene, moved, began_ns))
        while service.values.get("correction_mm", 0.0) < 8.0:
            await asyncio.sleep(0.1)
        assert "; poses are corrected by " in _drift(service)[0]
        errors_m = []
        async for pose in bus.every(topics.OBJECT, 64):
            truth = scene.truth((pose.stamp_ns - began_ns) * 1e-9)
            errors_m.append(np.linalg.norm(truth[:3, 3] - pose.position_m))
            if len(errors_m) >= 100:
                break
        player.cancel()
        # 9 mm without the correction.
        assert np.median(errors_m) < 0.004
    assert (config.calibration_dir / "objects.json").read_bytes() == written


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
