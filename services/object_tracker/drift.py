"""Compares objects' poses with the paint on their trackers, and tells what has drifted.

Only where something can be compared: an object's tracker has a marker in rig.toml, its place on the
tracker was measured, and the cameras are calibrated. Anything else is left alone, silently.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from pathlib import Path

from rhot import clock, topics
from rhot.errors import CalibrationError
from rhot.files.calibration import load_rig_cameras
from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.messages.objects import ObjectPose
from rhot.process.service import Service
from services.object_tracker.monitors.drift_correction import DriftCorrection
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


def open_drift(service: Service, correct: Callable[[Array], None]) -> DriftService | None:
    """The watch of a rig, or None where nothing can be compared; correct takes a rigid motion
    (4, 4) that is put before the registration.
    """
    objects = load_registration(service.config)
    if objects is None or not watched_colors(service.config, objects):
        return None
    try:
        cameras = load_rig_cameras(service.config)
    except CalibrationError:
        # `rhot check` and the trackers tell; objects do without cameras.
        return None
    monitor = DriftMonitor(service.config, objects, cameras)
    return DriftService(service, monitor, correct)


class DriftService:
    """The watch while the service runs; take() every object's pose, and start follow()."""

    def __init__(
        self, service: Service, monitor: DriftMonitor, correct: Callable[[Array], None]
    ) -> None:
        self._service, self._monitor, self._correct = service, monitor, correct
        self._corrects = service.config.objects.drift == "correct"
        self._correction = DriftCorrection()

    def take(self, pose: ObjectPose) -> None:
        """A pose that was published."""
        applied = self._correction.T_rig_from_before if self._corrects else None
        self._monitor.take_object(pose, applied)

    async def follow(self) -> None:
        """Hear the cameras and tell what has drifted, for ever."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._hear())
            while True:
                await asyncio.sleep(_LOOK_S)
                self._look(clock.now_ns())

    async def _hear(self) -> None:
        cameras = [camera.name for camera in self._service.config.camera]
        async for frame in self._service.bus.every(topics.MARKERS, 64, cameras):
            self._monitor.take_frame(frame)

    def _look(self, now_ns: int) -> None:
        drifts = self._monitor.look(now_ns)
        note = self._follow(drifts) if self._corrects else ""
        texts = {name: self._text(name, drift, now_ns) + note for name, drift in drifts.items()}
        self._service.faults.replace("registration_drift", texts)
        distances_m = self._monitor.distances_m().values()
        if distances_m:
            self._service.values["drift_mm"] = 1e3 * max(distances_m)

    def _follow(self, drifts: Mapping[str, Drift]) -> str:
        """Correct what only the lighthouses' frame explains; what to say of it."""
        of_frame = [drift.fit for drift in drifts.values() if drift.of_frame]
        best = max(of_frame, key=lambda fit: fit.significance(), default=None)
        if not self._correction.want(best):
            return "; that is too far to be corrected"
        self._correction.follow(_LOOK_S)
        self._correct(self._correction.T_rig_from_before)
        corrected_mm = 1e3 * self._correction.distance_m
        self._service.values["correction_mm"] = corrected_mm
        return f"; poses are corrected by {corrected_mm:.1f} mm" if best else ""

    def _text(self, name: str, drift: Drift, now_ns: int) -> str:
        color = self._monitor.color_of(name)
        for_s = max(now_ns * 1e-9 - drift.since_s, 0.0)
        text = (
            f"{name}: the {color} paint is {1e3 * drift.distance_m:.1f} mm from where its pose"
            f" puts it, for {for_s:.0f} s"
        )
        return text if drift.of_frame else f"{text}; the paint itself may have changed"
