"""The tracker's process: frame -> step() -> MarkerFrame, for one camera.

It waits for the start broadcast; a camera that fails ends it with SourceError, and systemd starts
it anew; a file that ends, ends it in peace. Colour ranges and exposure are changed without a
restart, by their files or over the bus (sinks/coloring.py, exposing.py); a live camera starts
without them, so that it can be calibrated.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Coroutine

from rhot import topics
from rhot.bus.master_clock import follow_master
from rhot.clock import OffsetEstimator
from rhot.process.service import Service
from services.pi_tracker import sources
from services.pi_tracker.endpoints.color_fitting import Fitting
from services.pi_tracker.endpoints.color_ranges import Coloring
from services.pi_tracker.endpoints.exposure_control import Exposing
from services.pi_tracker.endpoints.picture_cache import Album
from services.pi_tracker.endpoints.session_gate import SessionGate
from services.pi_tracker.image.frame import Frame


async def serve(service: Service) -> None:
    """Finds the coloured markers in one camera's images."""
    tracker = CameraTracker(service)
    gate = SessionGate(service.bus)
    companions = [
        service.tasks.create_task(task) for task in (gate.follow(), *tracker.companions())
    ]
    try:
        service.ready()
        service.state = "waiting"
        table = service.config.camera_named(service.instance)
        start_ns = (await gate.started()).start_ns if sources.is_file(table) else 0
        source = sources.open_source(table, service.config, service.bus, start_ns)
        tracker.exposing.attach(source.controls)
        companions.append(
            service.tasks.create_task(follow_master(service.bus, tracker.offset, source.now_ns))
        )
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
        camera = service.config.camera_named(service.instance)
        self.coloring = Coloring(service, live=not sources.is_file(camera))
        self.exposing = Exposing(service)
        self._markers = service.bus.publisher(topics.MARKERS, camera=camera.name)
        self._pictures = Album(service.bus, camera.name, service.tasks)
        Fitting(service, self._pictures, self.coloring)
        self._noted = 0

    def companions(self) -> list[Coroutine[None, None, None]]:
        """What runs beside the frames, for ever."""
        return [self.coloring.follow_file(), self.coloring.follow_bus(), self.exposing.follow()]

    def take(self, frame: Frame, source: sources.Source, *, running: bool) -> None:
        """One frame: markers while the session runs, pictures always."""
        if running:
            offset = self.offset.at(frame.stamp_ns)
            found = self.coloring.step.step(frame, offset.offset_ns, offset.sigma_ns)
            self._markers.put(found)
            values = self._service.values
            values["markers"] = len(found.markers)
            values["clock_offset_ms"] = offset.offset_ns * 1e-6
            values["clock_sigma_ms"] = offset.sigma_ns * 1e-6 if offset.sigma_ns >= 0 else -1.0
            values["skipped_frames"] = source.dropped
            values["rejected_frames"] = source.rejected
            self.coloring.look(frame, found.markers)
            for stage, took_ms in self.coloring.step.times_ms.items():
                values[f"{stage}_ms"] = took_ms
        self._pictures.show(frame, time.monotonic_ns())
        for note in source.notes[self._noted :]:
            self._service.error(note)
        self._noted = len(source.notes)
