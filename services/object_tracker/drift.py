"""Compares objects' poses with the paint on their trackers, and tells what has drifted.

Only where something can be compared: an object's tracker has a marker in rig.toml, its place on the
tracker was measured, and the cameras are calibrated. Anything else is left alone, silently.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

from rhot import clock, topics
from rhot.errors import CalibrationError
from rhot.files.calibration import load_rig_cameras
from rhot.files.config import RigConfig
from rhot.messages.objects import ObjectPose
from rhot.process.service import Service
from services.object_tracker.monitors.drift_monitor import DriftMonitor, watched_colors
from services.object_tracker.monitors.drift_watch import Drift
from services.object_tracker.registration import load_registration

_LOOK_S = 1.0


def camera_files(config: RigConfig) -> list[Path]:
    """Files of calibration/ that the watch uses beside objects.json; none without any paint."""
    if not any(item.marker for item in config.object):
        return []
    lenses = [f"{camera.name}.lens.json" for camera in config.camera]
    return [config.calibration_dir / name for name in ("rig.json", *lenses)]


def open_drift(service: Service) -> DriftService | None:
    """The watch of a rig, or None where nothing can be compared."""
    objects = load_registration(service.config)
    if objects is None or not watched_colors(service.config, objects):
        return None
    try:
        cameras = load_rig_cameras(service.config)
    except CalibrationError:
        # `rhot check` and the trackers tell; objects do without cameras.
        return None
    return DriftService(service, DriftMonitor(service.config, objects, cameras))


class DriftService:
    """The watch while the service runs; take() every object's pose, and start follow()."""

    def __init__(self, service: Service, monitor: DriftMonitor) -> None:
        self._service, self._monitor = service, monitor

    def take(self, pose: ObjectPose) -> None:
        """A pose that was published."""
        self._monitor.take_object(pose)

    async def follow(self) -> None:
        """Hear the cameras and tell what has drifted, for ever."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._hear())
            while True:
                await asyncio.sleep(_LOOK_S)
                self._look(clock.now_ns())

    async def _hear(self) -> None:
        async for frame in self._service.bus.every(topics.MARKERS, 64):
            self._monitor.take_frame(frame)

    def _look(self, now_ns: int) -> None:
        drifts = self._monitor.look(now_ns)
        texts = {name: self._text(name, drift, now_ns) for name, drift in drifts.items()}
        self._service.faults.replace("registration_drift", texts)
        distances_m = self._monitor.distances_m().values()
        if distances_m:
            self._service.values["drift_mm"] = 1e3 * max(distances_m)

    def _text(self, name: str, drift: Drift, now_ns: int) -> str:
        color = self._monitor.color_of(name)
        for_s = max(now_ns * 1e-9 - drift.since_s, 0.0)
        text = (
            f"{name}: the {color} paint is {1e3 * drift.distance_m:.1f} mm from where its pose"
            f" puts it, for {for_s:.0f} s"
        )
        return text if drift.of_frame else f"{text}; the paint itself may have changed"
