"""The tracker's process: frame -> step() -> MarkerFrame, for one camera.

It waits for the start broadcast; a camera that fails ends it with SourceError, and systemd starts
it anew; a file that ends, ends it in peace. Colour ranges and exposure are changed without a
restart, by their files or over the bus (endpoints/color_ranges.py, exposure_control.py); a live
camera starts without them, so that it can be calibrated.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Coroutine

from rhot import topics
from rhot.bus.master_clock import follow_master
from rhot.clock import OffsetEstimator
from rhot.messages import MarkerFrame
from rhot.process.computer.watch import watch_computer
from rhot.process.service import Service
from services.pi_tracker import sources
from services.pi_tracker.compiled import library
from services.pi_tracker.endpoints.camera_faults import CameraFaults
from services.pi_tracker.endpoints.color_fitting import ColorFitting
from services.pi_tracker.endpoints.color_ranges import ColorRanges
from services.pi_tracker.endpoints.exposure_control import ExposureEndpoint
from services.pi_tracker.endpoints.picture_cache import PictureCache
from services.pi_tracker.endpoints.session_gate import SessionGate
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.monitors.camera_monitor import CameraMonitor
from services.pi_tracker.tracker import CameraTracker

log = logging.getLogger("rhot.pi_tracker")


async def serve(service: Service) -> None:
    """Finds the coloured markers in one camera's images."""
    log.info("markers are measured %s", library.state)
    gate = SessionGate(service.bus)
    camera = CameraService(service, gate)
    beside = (gate.follow(), watch_computer(service), *camera.companions())
    companions = [service.tasks.create_task(task) for task in beside]
    try:
        service.ready()
        service.state = "waiting"
        table = service.config.camera_named(service.instance)
        start_ns = (await gate.started()).start_ns if sources.is_file(table) else 0
        source = sources.open_source(table, service.config, service.bus, start_ns)
        camera.attach(source)
        companions.append(
            service.tasks.create_task(
                follow_master(service.bus, camera.offset, source.now_ns, service.second_clock)
            )
        )
        async with contextlib.aclosing(source.frames()) as frames:
            async for frame in frames:
                service.state = "running" if gate.running else "waiting"
                camera.take(frame, source, running=gate.running)
    finally:
        for task in companions:
            task.cancel()


class CameraService:
    """One camera's tracker with its endpoints on the bus: what the service does with each frame."""

    def __init__(self, service: Service, gate: SessionGate) -> None:
        self.offset = OffsetEstimator()
        self._service = service
        camera = service.config.camera_named(service.instance)
        live = not sources.is_file(camera)
        self._tracker = CameraTracker(service.config, camera, time.perf_counter_ns)
        self._colors = ColorRanges(service, self._tracker, live=live)
        self._exposure = ExposureEndpoint(service)
        self._monitor = CameraMonitor(camera.name, camera.fps, live=live)
        self._faults = CameraFaults(service, self._tracker, self._monitor, gate, self.offset)
        # Markers of any kind in the last picture.
        self._seen = 0
        self._markers = service.bus.publisher(topics.MARKERS, camera=camera.name)
        self._pictures = PictureCache(service.bus, camera.name, service.tasks)
        ColorFitting(service, self._pictures, self._tracker)

    def companions(self) -> list[Coroutine[None, None, None]]:
        """What runs beside the frames, for ever."""
        return [
            self._colors.follow_file(),
            self._colors.follow_bus(),
            self._exposure.follow(),
            self._faults.follow(),
        ]

    def attach(self, source: sources.Source) -> None:
        """The source of the frames."""
        self._exposure.attach(source.controls)
        self._faults.attach(source)

    def take(self, frame: Frame, source: sources.Source, *, running: bool) -> None:
        """One frame: markers while the session runs, pictures always.

        A picture that comes again is not measured again.
        """
        now_ns = time.monotonic_ns()
        seen = None
        if self._monitor.is_new(frame, now_ns) and running:
            found = self._track(frame)
            seen = self._tracker.seen(found)
            self._seen = len(found.markers)
            self._faults.markers = int(self._service.values["markers"])
            self._service.values["skipped_frames"] = source.dropped
            self._service.values["rejected_frames"] = source.rejected
            self._watch_drift(frame, found)
        self._monitor.watch(frame, self._seen if running else 0, now_ns)
        self._pictures.show(frame, now_ns, seen)

    def _track(self, frame: Frame) -> MarkerFrame:
        offset = self.offset.at(frame.stamp_ns)
        found = self._tracker.step(frame, offset)
        self._markers.put(found)
        values = self._service.values
        of_hands = self._service.config.counted(one.color for one in found.markers)
        values["markers"] = len(of_hands)
        values["clock_offset_ms"] = offset.offset_ns * 1e-6
        values["clock_sigma_ms"] = offset.sigma_ns * 1e-6 if offset.sigma_ns >= 0 else -1.0
        for stage, took_ms in self._tracker.times_ms.items():
            values[f"{stage}_ms"] = took_ms
        return found

    def _watch_drift(self, frame: Frame, found: MarkerFrame) -> None:
        values, drifted = self._tracker.watch_drift(frame, found)
        self._service.values.update(values)
        if drifted is not None:
            self._colors.tell_drift(drifted)
