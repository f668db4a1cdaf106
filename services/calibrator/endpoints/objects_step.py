"""Painted trackers moved before the cameras: told to a page, and the registration of them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from rhot import topics
from rhot.errors import CalibrationError
from rhot.files.calibration import Objects, load_objects, load_rig_cameras
from rhot.messages.simulator import SimStage
from rhot.topics import Topic
from services.calibrator.endpoints.desk import Desk
from services.calibrator.endpoints.practice import practising
from services.calibrator.guided.found import Found
from services.calibrator.guided.objects import objects_found
from services.calibrator.objects.recorded import Recorded
from services.calibrator.objects.register import register
from services.calibrator.objects.wanted import Painted, painted_objects
from services.calibrator.output.objects_file import objects_file

T = TypeVar("T")

_LOOK_S = 1.0
# So long at least: more of the same seconds average the noise away.
_SECONDS = 20.0
# Who has not moved it by then has gone away.
_PATIENCE_S = 180.0
# Trackers send 30 pictures a second, SteamVR 90 poses: so long without any and none will come.
_SILENT_S = 8.0
# SteamVR may send a second's worth at once.
_QUEUE = 512
# What a registration may lack at most (services/calibrator/objects/guidance.py).
_KINDS = 4


async def objects_step(desk: Desk) -> Found:
    """Listen until there is enough, then register.

    Raises CalibrationError that says what is missing.
    """
    painted = painted_objects(desk.config, [], None)
    recorded = Recorded()
    async with practising(desk, SimStage(scene="registration")):
        listeners = [asyncio.create_task(one) for one in _listeners(desk, recorded)]
        try:
            await _listen(desk, recorded, painted)
        finally:
            for listener in listeners:
                listener.cancel()
    desk.computing("The lighthouses' frame is being found; this takes some seconds.")
    return await asyncio.to_thread(_registered, desk, recorded, painted)


def _listeners(desk: Desk, recorded: Recorded) -> list[Coroutine[Any, Any, None]]:
    async def take(topic: Topic[T], add: Callable[[T], object]) -> None:
        subscription = desk.bus.every(topic, _QUEUE)
        try:
            async for message in subscription:
                add(message)
        finally:
            desk.bus.close(subscription)

    return [take(topics.MARKERS, recorded.add_frame), take(topics.OPENVR, recorded.add_pose)]


async def _listen(desk: Desk, recorded: Recorded, painted: list[Painted]) -> None:
    cameras = load_rig_cameras(desk.config)
    began_s = time.monotonic()
    names = " and ".join(one.name for one in painted)
    desk.tell(0.0, f"move {names} slowly through the whole volume, and turn it all the while", [])
    while True:
        await asyncio.sleep(_LOOK_S)
        passed_s = time.monotonic() - began_s
        if passed_s > _SILENT_S:
            _check_silence(recorded, painted)
        missing = []
        for one in painted:
            missing += await asyncio.to_thread(recorded.still_missing, one, cameras)
        if passed_s >= _SECONDS and not missing:
            return
        if passed_s > _PATIENCE_S:
            raise CalibrationError(f"not enough after {passed_s:.0f} s: {'; '.join(missing)}")
        enough = 1.0 - len(missing) / (_KINDS * len(painted))
        to_do = missing[0] if missing else "go on moving and turning it"
        seen = [f"{len(recorded.frames)} pictures", f"{passed_s:.0f} s"]
        desk.tell(min(passed_s / _SECONDS, 1.0) * max(enough, 0.0), to_do, seen)


def _check_silence(recorded: Recorded, painted: list[Painted]) -> None:
    if not recorded.frames:
        raise CalibrationError(
            "no markers come from any camera: are the trackers running? `rhot top` shows it"
        )
    for one in painted:
        if one.serial not in recorded.poses:
            raise CalibrationError(
                f"no poses of {one.serial} ({one.name}'s tracker): is it switched on, and its "
                "serial right in rig.toml? `rhot doctor` finds the first link that is broken"
            )


def _registered(desk: Desk, recorded: Recorded, painted: list[Painted]) -> Found:
    config = desk.config
    cameras = load_rig_cameras(config)
    found = register(recorded.sightings(cameras, painted), recorded.paths())
    names = {one.serial: one.name for one in painted}
    world = config.rig.world
    inputs = {
        "source": "live",
        "markers": {one.name: one.color for one in painted},
        # The registration holds for this frame of the rig only.
        "T_rig_from_camera": None if world is None else world.T_rig_from_camera,
    }
    others = [table.name for table in config.object]
    made = objects_file(found, names, _before(desk), others, (desk.date(), inputs))
    return objects_found(made, found, list(names.values()))


def _before(desk: Desk) -> Objects | None:
    """What is known of where objects sit on their trackers."""
    folder = desk.config.calibration_dir
    return load_objects(folder) if (folder / "objects.json").exists() else None
