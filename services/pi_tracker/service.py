"""The tracker's process: frame -> step() -> MarkerFrame, for one camera.

It waits for the start broadcast; a camera that fails ends it with SourceError, and systemd starts it anew; a file that ends, ends
it in peace. New colour ranges in calibration/<camera>.colors.json take effect without a restart; ones that do not fit are
reported and the old ones stay.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from pathlib import Path

from rhot import topics
from rhot.calibration import load_colors
from rhot.clock import OffsetEstimator, follow_master
from rhot.errors import CalibrationError
from rhot.service import Service
from services.pi_tracker import sources
from services.pi_tracker.frame import Frame
from services.pi_tracker.sinks.pictures import Pictures
from services.pi_tracker.sources.session import SessionGate
from services.pi_tracker.step import TrackerStep

# New colours are in force a second after they were saved.
_COLORS_PERIOD_S = 1.0


async def serve(service: Service) -> None:
    """Finds the coloured markers in one camera's images."""
    tracker = CameraTracker(service)
    gate = SessionGate(service.bus)
    companions = [service.tasks.create_task(task) for task in (gate.follow(), tracker.follow_colors())]
    try:
        service.ready()
        service.state = "waiting"
        table = service.config.camera_named(service.instance)
        start_ns = (await gate.started()).start_ns if sources.is_file(table) else 0
        source = sources.open_source(table, service.config, service.bus, start_ns)
        companions.append(service.tasks.create_task(follow_master(service.bus, tracker.offset, source.now_ns)))
        async with contextlib.aclosing(source.frames()) as frames:
            async for frame in frames:
                service.state = "running" if gate.running else "waiting"
                tracker.take(frame, source, running=gate.running)
    finally:
        for task in companions:
            task.cancel()


class CameraTracker:
    """What the service does with each frame."""

    def __init__(self, service: Service) -> None:
        self.offset = OffsetEstimator()
        self._service = service
        config = service.config
        camera = config.camera_named(service.instance)
        self._colors_path = config.calibration_dir / f"{camera.name}.colors.json"
        colors = load_colors(config.calibration_dir, camera.name)
        self._step = TrackerStep(
            camera.name,
            colors,
            config.tracker,
            camera.size_px,
            # Without a hand nobody says which colours matter: all of them do.
            config.colors or sorted(colors.colors),
            time.perf_counter_ns,
            self._colors_path,
        )
        self._markers = service.bus.publisher(topics.MARKERS, camera=camera.name)
        self._pictures = Pictures(service.bus, camera.name, service.tasks)
        self._noted = 0

    def take(self, frame: Frame, source: sources.Source, *, running: bool) -> None:
        """One frame: markers while the session runs, pictures always."""
        if running:
            offset = self.offset.at(frame.stamp_ns)
            found = self._step.step(frame, offset.offset_ns, offset.sigma_ns)
            self._markers.put(found)
            values = self._service.values
            values["markers"] = len(found.markers)
            values["clock_offset_ms"] = offset.offset_ns * 1e-6
            values["clock_sigma_ms"] = offset.sigma_ns * 1e-6 if offset.sigma_ns >= 0 else -1.0
            values["skipped_frames"] = source.dropped
            values["rejected_frames"] = source.rejected
            for stage, took_ms in self._step.times_ms.items():
                values[f"{stage}_ms"] = took_ms
        self._pictures.show(frame, time.monotonic_ns())
        for note in source.notes[self._noted :]:
            self._service.error(note)
        self._noted = len(source.notes)

    async def follow_colors(self) -> None:
        """Take changed colour ranges into force, for ever."""
        seen = _changed_ns(self._colors_path)
        while True:
            await asyncio.sleep(_COLORS_PERIOD_S)
            now = _changed_ns(self._colors_path)
            if now != seen and now != 0:
                seen = now
                try:
                    self._step.recolor(load_colors(self._colors_path.parent, self._service.instance), self._colors_path)
                except CalibrationError as error:
                    self._service.error(str(error))


def _changed_ns(path: Path) -> int:
    """Time of the last change, 0 while there is no such file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
